/* Which of the copies that `DISPATCHED` makes this processor runs, and what Python may call. */

#include "elementary.h"

/* A digest of all structs and functions of these files: tests/native/test_interface.py says what it is to be. */
int64_t petcontact_interface(void)
{
    return 0x1ba2a7ee;
}

/* Its name; empty where this processor lacks the one level that was compiled. */
void petcontact_level(char *name)
{
#ifdef PETCONTACT_LEVELS
    strcpy(name, __builtin_cpu_supports("x86-64-v4")   ? "x86-64-v4"
                 : __builtin_cpu_supports("x86-64-v3") ? "x86-64-v3"
                                                       : "x86-64");
#elif defined(PETCONTACT_LEVEL)
    strcpy(name, __builtin_cpu_supports(PETCONTACT_LEVEL) ? PETCONTACT_LEVEL : "");
#else
    strcpy(name, "one level");
#endif
}
