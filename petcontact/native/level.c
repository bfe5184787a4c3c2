/* Which of the copies that `DISPATCHED` makes this processor runs. */

#include "elementary.h"

void petcontact_level(char *name)
{
#ifdef PETCONTACT_LEVELS
    strcpy(name, __builtin_cpu_supports("x86-64-v4")   ? "x86-64-v4"
                 : __builtin_cpu_supports("x86-64-v3") ? "x86-64-v3"
                                                       : "x86-64");
#else
    strcpy(name, "one level");
#endif
}
