/* The shaft of one motor as a model: see shaft.c. */
#ifndef QO_SIZES_H
#define QO_SIZES_H

#define QO_NX 1
#define QO_NU 3
#define QO_NP 1
#define QO_NY 2
#define QO_NZ 1

#endif
