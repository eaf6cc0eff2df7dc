/* The controller of a campaign behind core.h: feed-forward plus one cascade a coordinate, once every sample time.
 *
 * What it remembers is in x and holds between samples: those of its outputs that are in x, too. Nothing but a sample
 * changes anything, so derivatives of every kind are zero. The law is that of ident/campaign/controller.py. */
#include <math.h>
#include <string.h>

#include "core.h"
#include "qo_equations.h"
#include "qo_internal.h"
#include "qo_reference.h"

#define WHEELS 4

/* Instants closer than this share of a sample time are one. */
#define SAME_INSTANT 1e-6

/* What a coordinate is and does at a sample. */
typedef struct {
    double position, rate;
} qo_measured;

/* The sample of the reference that was taken last; the last one of all where the reference has ended. */
static int present(const double *x)
{
    const double last = x[QO_X_SAMPLE] - 1.0;
    return last < 0.0 ? 0 : last > QO_SAMPLES - 1 ? QO_SAMPLES - 1 : (int)last;
}

void qo_eq_outputs(const double *x, const double *u, const double *p, double *y)
{
    const int index = present(x);
    int loop;
    (void)u, (void)p;
    for (loop = 0; loop < QO_LOOPS; loop++) {
        y[loop] = qo_positions[loop][index];
    }
    memcpy(y + QO_LOOPS, qo_path[index], sizeof qo_path[index]);
}

void qo_eq_derivatives(const double *x, const double *u, const double *p, double *xd)
{
    (void)x, (void)u, (void)p;
    memset(xd, 0, QO_NX * sizeof *xd);
}

/* The mode of (9) is that of the reference, whatever the angles are. */
void qo_eq_mode_distances(const double *x, const double *u, const double *p, double *z)
{
    (void)x, (void)u, (void)p;
    z[0] = QO_MOTION_MODE == 4 ? -1.0 : 1.0;
    z[1] = QO_MOTION_MODE == 3 ? -1.0 : 1.0;
    z[2] = z[3] = QO_MOTION_MODE == 2 ? -1.0 : 1.0;
}

void qo_eq_jacobian_vector(const double *x, const double *u, const double *p, const double *dx, const double *du,
                           const double *dp, double *sxd, double *sy)
{
    (void)x, (void)u, (void)p, (void)dx, (void)du, (void)dp;
    memset(sxd, 0, QO_NX * sizeof *sxd);
    memset(sy, 0, QO_NY * sizeof *sy);
}

void qo_eq_vector_jacobian(const double *x, const double *u, const double *p, const double *lxd, const double *ly,
                           double *ax, double *au, double *ap)
{
    (void)x, (void)u, (void)p, (void)lxd, (void)ly;
    memset(ax, 0, QO_NX * sizeof *ax);
    memset(au, 0, QO_NU * sizeof *au);
    memset(ap, 0, QO_NP * sizeof *ap);
}

/* Before the first sample every wheel has always been where it is. */
static void begin(qo_model *model)
{
    int index;
    memcpy(model->x + QO_X_LAST_BETA, model->u + QO_U_BETA, WHEELS * sizeof(double));
    for (index = 0; index < 2 * QO_RATE_CYCLES; index++) {
        model->x[QO_X_PAST_ALPHA + index] = model->u[QO_U_ALPHA + index / QO_RATE_CYCLES];
    }
}

/* A steering angle, and its rate over some cycles: one alone does not resolve it. */
static qo_measured steering(qo_model *model, int side)
{
    double *past = model->x + QO_X_PAST_ALPHA + QO_RATE_CYCLES * side;
    const double angle = model->u[QO_U_ALPHA + side];
    const qo_measured found = {angle, (angle - past[0]) / (QO_RATE_CYCLES * QO_SAMPLE_TIME)};
    memmove(past, past + 1, (QO_RATE_CYCLES - 1) * sizeof *past);
    past[QO_RATE_CYCLES - 1] = angle;
    return found;
}

/* How far the wheels have carried a coordinate along its column of H_k. */
static qo_measured travel(qo_model *model, const double *wheels, double norm)
{
    double moved = 0.0;
    qo_measured found;
    int wheel;
    for (wheel = 0; wheel < WHEELS; wheel++) {
        moved += wheels[wheel] / norm * (model->u[QO_U_BETA + wheel] - model->x[QO_X_LAST_BETA + wheel]);
    }
    model->x[QO_X_TRAVEL] += moved;
    found.position = model->x[QO_X_TRAVEL];
    found.rate = moved / QO_SAMPLE_TIME;
    return found;
}

static double within(double value, double bound)
{
    return value > bound ? bound : value < -bound ? -bound : value;
}

/* The integrator of a loop: bounded, and at standstill quicker outside the dead band, leaking inside. */
static double integrate(const qo_model *model, int loop, double wanted, double error, double velocity_error)
{
    const double *p = model->p;
    const double bound = p[QO_P_INTEGRAL_LIMIT + loop], gain = p[QO_P_INTEGRAL_GAIN + loop] * QO_SAMPLE_TIME;
    const int inside = fabs(error) < p[QO_P_DEAD_BAND + loop];
    double integral = model->x[QO_X_INTEGRAL + loop];
    if (fabs(wanted) > QO_REST) {
        return within(integral + gain * velocity_error, bound);
    }
    if (inside || error * integral < 0.0) {
        integral *= QO_LEAK;
    }
    return inside ? integral : within(integral + QO_STANDSTILL_GAIN * gain * velocity_error, bound);
}

/* One cascade: adds its motor torques to those that there are. */
static qo_status follow(qo_model *model, int loop, int index, double *torques)
{
    const double *p = model->p, *wheels = qo_loops[loop].wheels + (size_t)index * (size_t)qo_loops[loop].stride;
    const double wanted = qo_velocities[loop][index];
    double norm = 0.0, error, velocity_error, torque;
    qo_measured found;
    int wheel;
    for (wheel = 0; wheel < WHEELS; wheel++) {
        norm += wheels[wheel] * wheels[wheel];
    }
    found = qo_loops[loop].side < 0 ? travel(model, wheels, norm) : steering(model, qo_loops[loop].side);
    error = qo_positions[loop][index] - found.position;
    if (!(fabs(error) <= p[QO_P_FOLLOWING_ERROR + loop])) {
        return qo_fail(model, QO_ERROR, "The coordinate ", qo_loops[loop].name,
                       " is further from its reference than its following_error: look for a blocked or slipping "
                       "wheel, or a wrong sign.");
    }
    velocity_error = wanted + p[QO_P_POSITION_GAIN + loop] * error - found.rate;
    model->x[QO_X_ERROR + loop] = error;
    model->x[QO_X_INTEGRAL + loop] = integrate(model, loop, wanted, error, velocity_error);
    torque = p[QO_P_VELOCITY_GAIN + loop] * velocity_error + model->x[QO_X_INTEGRAL + loop];
    for (wheel = 0; wheel < WHEELS; wheel++) {
        torques[wheel] += wheels[wheel] / (norm * QO_GEAR_RATIO) * torque;
    }
    return QO_OK;
}

static qo_status sample(qo_model *model)
{
    double torques[WHEELS];
    qo_status status = QO_OK;
    int loop, wheel, index;
    if (model->x[QO_X_SAMPLE] == 0.0) {
        begin(model);
    }
    model->x[QO_X_SAMPLE] += 1.0;
    index = present(model->x);
    memcpy(torques, qo_feed_forward[index], sizeof torques);
    for (loop = 0; loop < QO_LOOPS && status == QO_OK; loop++) {
        status = follow(model, loop, index, torques);
    }
    for (wheel = 0; wheel < WHEELS; wheel++) {
        model->x[QO_X_TORQUE + wheel] = within(torques[wheel], model->p[QO_P_TORQUE_LIMIT]);
        model->x[QO_X_LAST_BETA + wheel] = model->u[QO_U_BETA + wheel];
    }
    return status;
}

/* A sample is due where its time has come, and is taken at the beginning of a step, with the inputs that it has. */
qo_status qo_step(qo_model *model, double h)
{
    const qo_model before = *model;
    qo_status status = qo_check(model);
    if (status == QO_OK && !(h <= QO_SAMPLE_TIME * (1.0 + SAME_INSTANT))) {
        status = qo_fail(model, QO_ERROR, "The communication step", "",
                         " is longer than the sample time of the controller, sample_time in its documentation.");
    }
    if (status == QO_OK && model->x[QO_X_ELAPSED] >= (model->x[QO_X_SAMPLE] - SAME_INSTANT) * QO_SAMPLE_TIME) {
        status = sample(model);
    }
    if (status == QO_OK) {
        model->x[QO_X_ELAPSED] += h;
        status = qo_outputs(model);
    }
    if (status != QO_OK) {
        memcpy(model->x, before.x, sizeof model->x);
    }
    return status;
}

qo_status qo_advance(qo_model *model, double h, double *taken)
{
    *taken = h;
    return qo_step(model, h);
}

qo_status qo_fastest(qo_model *model, double *seconds)
{
    *seconds = QO_SAMPLE_TIME;
    return qo_check(model);
}
