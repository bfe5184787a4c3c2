/* Both kernels over a circular arc (arcs.c). */

#ifndef PETCONTACT_ARCS_H
#define PETCONTACT_ARCS_H

#include "elements.h"

void petcontact_arc_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Values *v);

#endif
