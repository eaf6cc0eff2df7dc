/* The plant of a drive alone, behind core.h: whoever imports it has the machine, and tells angle and speed of the shaft.
 *
 *   x  turned                       angle that the shaft has turned since the start [rad]
 *   u  angle, speed, torque         of the shaft [rad, rad/s]; of the drive [Nm]
 *   p  torque_gain                  torque on the shaft over what the drive takes it for
 *   y  shaft_torque, power          on the shaft [Nm, W]
 *
 * Between two communication points the angle goes on at the speed. */
#include <math.h>
#include <string.h>

#include "core.h"

#define LARGEST 1e12

enum { ANGLE, SPEED, TORQUE };

static const char *const inputs[QO_NU] = {"angle", "speed", "torque"};

const char *qo_state_name(int index) { return index == 0 ? "turned" : ""; }
const char *qo_input_name(int index) { return inputs[index]; }
const char *qo_parameter_name(int index) { return index == 0 ? "torque_gain" : ""; }
const char *qo_output_name(int index) { return index == 0 ? "shaft_torque" : "power"; }

static void compute(qo_model *model)
{
    model->y[0] = model->p[0] * model->u[TORQUE];
    model->y[1] = model->y[0] * model->u[SPEED];
}

void qo_init(qo_model *model)
{
    memset(model, 0, sizeof *model);
    model->p[0] = 1.0;
    model->tolerance = 1e-4;
    model->mode = 1;
}

static qo_status refuse(qo_model *model, const char *name)
{
    static const char what[] = " is not finite, or out of its bounds.";
    strcpy(model->message, name);
    strcat(model->message, what);
    return QO_ERROR;
}

static int fits(double value) { return fabs(value) <= LARGEST; }

qo_status qo_check(qo_model *model)
{
    int k;
    for (k = 0; k < QO_NU; k++) {
        if (!fits(model->u[k]) || !fits(model->ur[k])) {
            return refuse(model, inputs[k]);
        }
    }
    if (!(model->p[0] >= 0.0 && model->p[0] <= 10.0)) {
        return refuse(model, qo_parameter_name(0));
    }
    return fits(model->x[0]) ? QO_OK : refuse(model, qo_state_name(0));
}

qo_status qo_outputs(qo_model *model)
{
    const qo_status status = qo_check(model);
    if (status == QO_OK) {
        compute(model);
    }
    return status;
}

qo_status qo_derivatives(qo_model *model, double *xd)
{
    const qo_status status = qo_check(model);
    xd[0] = model->u[SPEED];
    return status;
}

qo_status qo_event_indicators(qo_model *model, double *z)
{
    z[0] = 1.0;
    return qo_check(model);
}

qo_status qo_update_discrete(qo_model *model, int *changed)
{
    *changed = 0;
    return qo_check(model);
}

qo_status qo_fastest(qo_model *model, double *seconds)
{
    *seconds = 1e-3; /* the loops of the drive */
    return qo_check(model);
}

qo_status qo_step(qo_model *model, double h)
{
    const qo_status status = qo_check(model);
    if (status == QO_OK) {
        model->x[0] += model->u[SPEED] * h;
        model->u[ANGLE] += model->u[SPEED] * h;
        compute(model);
    }
    return status == QO_OK ? qo_check(model) : status;
}

qo_status qo_advance(qo_model *model, double h, double *taken)
{
    *taken = h;
    return qo_step(model, h);
}

qo_status qo_jacobian_vector(qo_model *model, const double *dx, const double *du, const double *dp, double *sxd,
                             double *sy)
{
    const double torque = model->p[0] * model->u[TORQUE], change = dp[0] * model->u[TORQUE] + model->p[0] * du[TORQUE];
    (void)dx;
    sxd[0] = du[SPEED];
    sy[0] = change;
    sy[1] = change * model->u[SPEED] + torque * du[SPEED];
    return qo_check(model);
}

qo_status qo_vector_jacobian(qo_model *model, const double *lxd, const double *ly, double *ax, double *au, double *ap)
{
    const double both = ly[0] + ly[1] * model->u[SPEED];
    ax[0] = au[ANGLE] = 0.0;
    au[SPEED] = lxd[0] + ly[1] * model->p[0] * model->u[TORQUE];
    au[TORQUE] = both * model->p[0];
    ap[0] = both * model->u[TORQUE];
    return qo_check(model);
}
