/* The model of one vehicle and its solver, behind the FMI functions.
 *
 * Plain C99 on <math.h> and <string.h>: no allocation, no global that changes, no clock, no output. Everything an
 * instance has is in its qo_model, which is plain data: to copy, save or restore an instance is to copy the struct.
 * Sizes come from qo_sizes.h, generated from the table of variables; every index below is a position in that table.
 *
 *   x   continuous states              u   inputs                      p   parameters
 *   y   outputs that are not states    xd  derivatives of the states   mode   k of (9), 1 to 4
 *
 * A function that does not return QO_OK leaves x, u, p and mode as they were and a sentence in `message` that names
 * the variable at fault. None returns QO_OK with a number in its results that is not finite.
 */
#ifndef QO_CORE_H
#define QO_CORE_H

#include "qo_sizes.h"

#define QO_MESSAGE_SIZE 160

/* How many steps after a jump of the inputs have lengths of their own. */
#define QO_AFTER_JUMP 4

typedef enum {
    QO_OK = 0,
    QO_DISCARD = 1, /* the step cannot be taken: the error stays above the tolerance however short the step */
    QO_ERROR = 2    /* an input, parameter, state or argument cannot be, or a result is not finite */
} qo_status;

typedef struct {
    double x[QO_NX];
    double u[QO_NU];
    double p[QO_NP];
    double y[QO_NY];
    double ur[QO_NU]; /* rates of the inputs while time passes [per s]; zero: they are held */
    double tolerance; /* of a step, in units of the nominal values of the states */
    double step;      /* length that the next internal step tries [s] */
    double after_jump[QO_AFTER_JUMP]; /* the same of the first steps after inputs have jumped, one after the other */
    double last_u[QO_NU]; /* inputs at the end of the last internal step */
    int since_jump; /* internal steps since then, QO_AFTER_JUMP at most */
    int mode;         /* k of (9) */
    char message[QO_MESSAGE_SIZE];
} qo_model;

/* Start values of the table. Needs no other call before it; message is empty. */
void qo_init(qo_model *model);

/* The names of the table, for messages. */
const char *qo_state_name(int index);
const char *qo_input_name(int index);
const char *qo_parameter_name(int index);
const char *qo_output_name(int index);

/* Whether every x, u and p is finite and within its bounds, and every rate of an input finite. All functions below do this first. */
qo_status qo_check(qo_model *model);

/* y from x, u, p. */
qo_status qo_outputs(qo_model *model);

/* xd (QO_NX) from x, u, p. */
qo_status qo_derivatives(qo_model *model, double *xd);

/* z (QO_NZ): each changes its sign where the mode of (9) may change. */
qo_status qo_event_indicators(qo_model *model, double *z);

/* mode from x, p. *changed tells whether it is another one now. */
qo_status qo_update_discrete(qo_model *model, int *changed);

/* Time constant [s] of the fastest part of the model with the parameters p, at rest and straight ahead. */
qo_status qo_fastest(qo_model *model, double *seconds);

/* Integrates over h [s]: x, y, mode, and u where it has rates, at the end. As many internal steps as the tolerance asks for. */
qo_status qo_step(qo_model *model, double h);

/* One internal step of at most h [s]; *taken is its length. For a caller that stops at events. x, u and y,
 * not mode. */
qo_status qo_advance(qo_model *model, double h, double *taken);

/* Derivatives at x, u, p along a direction: sxd (QO_NX), sy (QO_NY) = d(xd, y)/d(x, u, p) (dx, du, dp). */
qo_status qo_jacobian_vector(qo_model *model, const double *dx, const double *du, const double *dp, double *sxd,
                             double *sy);

/* Adjoint derivatives: ax (QO_NX), au (QO_NU), ap (QO_NP) = the transposed matrix times (lxd (QO_NX), ly (QO_NY)). */
qo_status qo_vector_jacobian(qo_model *model, const double *lxd, const double *ly, double *ax, double *au,
                             double *ap);

#endif
