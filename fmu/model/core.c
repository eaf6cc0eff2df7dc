/* The model behind core.h: checks, outputs, modes, derivatives along directions. The solver is in solver.c. */
#include "core.h"

#include <math.h>
#include <string.h>

#include "qo_equations.h"
#include "qo_internal.h"

static void append(char *message, const char *text) {
    size_t used = strlen(message);
    size_t length = strlen(text);
    size_t room = QO_MESSAGE_SIZE - 1 - used;
    if (length > room) {
        length = room;
    }
    memcpy(message + used, text, length);
    message[used + length] = '\0';
}

qo_status qo_fail(qo_model *model, qo_status status, const char *kind, const char *name, const char *what) {
    model->message[0] = '\0';
    append(model->message, kind);
    append(model->message, name);
    append(model->message, what);
    return status;
}

int qo_first_not_finite(const double *values, int count) {
    int index;
    for (index = 0; index < count; ++index) {
        if (!isfinite(values[index])) {
            return index;
        }
    }
    return -1;
}

const char *qo_state_name(int index) { return qo_states[index].name; }
const char *qo_input_name(int index) { return qo_inputs[index].name; }
const char *qo_parameter_name(int index) { return qo_parameters[index].name; }
const char *qo_output_name(int index) { return qo_outputs_by_name[index]; }

static void start_values(double *values, const qo_row *rows, int count) {
    int index;
    for (index = 0; index < count; ++index) {
        values[index] = rows[index].start;
    }
}

void qo_init(qo_model *model) {
    int changed, index;
    memset(model, 0, sizeof *model);
    start_values(model->x, qo_states, QO_NX);
    start_values(model->u, qo_inputs, QO_NU);
    start_values(model->p, qo_parameters, QO_NP);
    model->tolerance = QO_TOLERANCE;
    model->step = QO_FIRST_STEP;
    for (index = 0; index < QO_AFTER_JUMP; ++index) {
        model->after_jump[index] = QO_FIRST_STEP;
    }
    memcpy(model->last_u, model->u, sizeof model->u);
    model->mode = 1;
    qo_update_discrete(model, &changed);
    qo_outputs(model);
}

/* Bounds are finite, so that what is no number or infinite is not between them. */
static int fits(const qo_row *row, double value) {
    return value >= row->minimum && value <= row->maximum && !(row->positive && value == 0.0);
}

static const char *objection(const qo_row *row, double value) {
    if (!isfinite(value)) {
        return " is not finite.";
    }
    return row->positive && value == 0.0 ? " must be greater than zero." : " is out of its bounds.";
}

static qo_status check_block(qo_model *model, const char *kind, const double *values, const qo_row *rows, int count) {
    int index;
    for (index = 0; index < count; ++index) {
        if (!fits(&rows[index], values[index])) {
            return qo_fail(model, QO_ERROR, kind, rows[index].name, objection(&rows[index], values[index]));
        }
    }
    return QO_OK;
}

static qo_status check_rates(qo_model *model) {
    const int broken = qo_first_not_finite(model->ur, QO_NU);
    return broken < 0 ? QO_OK : qo_fail(model, QO_ERROR, "The rate of ", qo_inputs[broken].name, " is not finite.");
}

qo_status qo_check(qo_model *model) {
    qo_status status = check_block(model, "Parameter ", model->p, qo_parameters, QO_NP);
    if (status == QO_OK) {
        status = check_block(model, "Input ", model->u, qo_inputs, QO_NU);
    }
    if (status == QO_OK) {
        status = check_block(model, "State ", model->x, qo_states, QO_NX);
    }
    return status == QO_OK ? check_rates(model) : status;
}

static qo_status compute_outputs(qo_model *model) {
    double y[QO_NY];
    int broken;
    qo_eq_outputs(model->x, model->u, model->p, y);
    broken = qo_first_not_finite(y, QO_NY);
    if (broken >= 0) {
        return qo_fail(model, QO_ERROR, "Output ", qo_outputs_by_name[broken], " is not finite.");
    }
    memcpy(model->y, y, sizeof y);
    return QO_OK;
}

qo_status qo_outputs(qo_model *model) {
    qo_status status = qo_check(model);
    return status == QO_OK ? compute_outputs(model) : status;
}

qo_status qo_outputs_after_step(qo_model *model) {
    qo_status status = check_block(model, "Input ", model->u, qo_inputs, QO_NU);
    if (status == QO_OK) {
        status = check_block(model, "State ", model->x, qo_states, QO_NX);
    }
    return status == QO_OK ? compute_outputs(model) : status;
}

qo_status qo_derivatives(qo_model *model, double *xd) {
    int broken;
    qo_status status = qo_check(model);
    if (status != QO_OK) {
        return status;
    }
    qo_eq_derivatives(model->x, model->u, model->p, xd);
    broken = qo_first_not_finite(xd, QO_NX);
    if (broken >= 0) {
        return qo_fail(model, QO_ERROR, "The derivative of ", qo_states[broken].name, " is not finite.");
    }
    return QO_OK;
}

static qo_status compute_indicators(qo_model *model, double *z) {
    qo_eq_mode_distances(model->x, model->u, model->p, z);
    if (qo_first_not_finite(z, QO_NZ) >= 0) {
        return qo_fail(model, QO_ERROR, "Output ", "mode", " has no finite condition.");
    }
    return QO_OK;
}

qo_status qo_event_indicators(qo_model *model, double *z) {
    qo_status status = qo_check(model);
    return status == QO_OK ? compute_indicators(model, z) : status;
}

/* (9), in the order of ident.vehicle.modes: the angles of mode 4 meet the condition of mode 2 as well. */
static int mode_of(const double *z) {
    if (z[0] < 0.0) {
        return 4;
    }
    if (z[1] < 0.0) {
        return 3;
    }
    return z[2] < 0.0 && z[3] < 0.0 ? 2 : 1;
}

qo_status qo_update_discrete(qo_model *model, int *changed) {
    qo_status status = qo_check(model);
    return status == QO_OK ? qo_mode_after_step(model, changed) : status;
}

qo_status qo_mode_after_step(qo_model *model, int *changed) {
    double z[QO_NZ];
    qo_status status = compute_indicators(model, z);
    if (status == QO_OK) {
        int mode = mode_of(z);
        *changed = mode != model->mode;
        model->mode = mode;
    }
    return status;
}

static qo_status check_direction(qo_model *model, const double *values, int count) {
    if (qo_first_not_finite(values, count) >= 0) {
        return qo_fail(model, QO_ERROR, "A ", "seed", " is not finite.");
    }
    return QO_OK;
}

static qo_status check_sensitivity(qo_model *model, const double *values, int count, const char *name) {
    if (qo_first_not_finite(values, count) >= 0) {
        return qo_fail(model, QO_ERROR, "A partial derivative of ", name, " is not finite.");
    }
    return QO_OK;
}

qo_status qo_jacobian_vector(qo_model *model, const double *dx, const double *du, const double *dp, double *sxd,
                             double *sy) {
    qo_status status = qo_check(model);
    if (status != QO_OK || (status = check_direction(model, dx, QO_NX)) != QO_OK ||
        (status = check_direction(model, du, QO_NU)) != QO_OK ||
        (status = check_direction(model, dp, QO_NP)) != QO_OK) {
        return status;
    }
    qo_eq_jacobian_vector(model->x, model->u, model->p, dx, du, dp, sxd, sy);
    status = check_sensitivity(model, sxd, QO_NX, "a derivative");
    return status != QO_OK ? status : check_sensitivity(model, sy, QO_NY, "an output");
}

qo_status qo_vector_jacobian(qo_model *model, const double *lxd, const double *ly, double *ax, double *au,
                             double *ap) {
    qo_status status = qo_check(model);
    if (status != QO_OK || (status = check_direction(model, lxd, QO_NX)) != QO_OK ||
        (status = check_direction(model, ly, QO_NY)) != QO_OK) {
        return status;
    }
    qo_eq_vector_jacobian(model->x, model->u, model->p, lxd, ly, ax, au, ap);
    if ((status = check_sensitivity(model, ax, QO_NX, "a state")) != QO_OK ||
        (status = check_sensitivity(model, au, QO_NU, "an input")) != QO_OK) {
        return status;
    }
    return check_sensitivity(model, ap, QO_NP, "a parameter");
}
