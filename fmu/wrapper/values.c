/* Values of variables, their derivatives, and the states of model exchange. */
#include <string.h>

#include "instance.h"

#define SETTABLE_STATES (QO_INSTANTIATED | QO_INITIALIZATION)
#define SETTABLE_PARAMETERS (QO_INSTANTIATED | QO_INITIALIZATION | QO_EVENT | QO_STEP)

const qo_variable *qo_find(const qo_instance *me, unsigned reference)
{
    if (reference >= QO_VARIABLES) {
        qo_tell(me, QO_ANSWER_ERROR, "There is no variable with value reference %u.", reference);
        return NULL;
    }
    return &qo_variables[reference];
}

static int fits(const qo_instance *me, const void *references, size_t n, const void *values, size_t n_values)
{
    if (n != n_values) {
        qo_tell(me, QO_ANSWER_ERROR, "%lu variables have %lu values, not %lu.", (unsigned long)n, (unsigned long)n,
                (unsigned long)n_values);
        return 0;
    }
    if (n > 0 && (references == NULL || values == NULL)) {
        qo_tell(me, QO_ANSWER_ERROR, "The value references or the values are a null pointer.");
        return 0;
    }
    return 1;
}

static qo_status compute(qo_instance *me, int what)
{
    qo_status status = QO_OK;
    qo_snapshot *now = &me->now;
    if (now->known & what) {
        return QO_OK;
    }
    if (what == QO_KNOWN_OUTPUTS) {
        status = qo_outputs(&now->model);
    } else if (what == QO_KNOWN_DERIVATIVES) {
        status = qo_derivatives(&now->model, now->derivatives);
    } else if (what == QO_KNOWN_INDICATORS) {
        status = qo_event_indicators(&now->model, now->indicators);
    } else if (what == QO_KNOWN_FASTEST) {
        status = qo_fastest(&now->model, &now->fastest);
    }
    now->known |= status == QO_OK ? what : 0;
    return status;
}

static const struct {
    int what; /* to compute before its value is read */
    int settable;
} roles[] = {
    [QO_TIME] = {0, 0},
    [QO_STATE] = {0, SETTABLE_STATES},
    [QO_DERIVATIVE] = {QO_KNOWN_DERIVATIVES, 0},
    [QO_INPUT] = {0, SETTABLE_PARAMETERS | QO_CONTINUOUS_TIME | QO_UPDATING},
    [QO_PARAMETER] = {0, SETTABLE_PARAMETERS},
    [QO_OUTPUT] = {QO_KNOWN_OUTPUTS, 0},
    [QO_DISCRETE] = {0, 0},
    [QO_CALCULATED] = {QO_KNOWN_FASTEST, 0},
    [QO_INDICATOR] = {QO_KNOWN_INDICATORS, 0},
};

static double *place(qo_snapshot *now, const qo_variable *variable)
{
    switch (variable->role) {
    case QO_STATE: return now->model.x + variable->index;
    case QO_DERIVATIVE: return now->derivatives + variable->index;
    case QO_INPUT: return now->model.u + variable->index;
    case QO_PARAMETER: return now->model.p + variable->index;
    case QO_OUTPUT: return now->model.y + variable->index;
    case QO_CALCULATED: return &now->fastest;
    case QO_INDICATOR: return now->indicators + variable->index;
    default: return &now->time;
    }
}

qo_answer qo_get(qo_instance *me, const unsigned references[], size_t n, double values[], size_t n_values)
{
    size_t i;
    if (!fits(me, references, n, values, n_values)) {
        return QO_ANSWER_ERROR;
    }
    for (i = 0; i < n; i++) {
        const qo_variable *variable = qo_find(me, references[i]);
        qo_status status;
        if (variable == NULL) {
            return QO_ANSWER_ERROR;
        }
        if (variable->role == QO_DISCRETE) {
            return qo_tell(me, QO_ANSWER_ERROR, "%s is an integer.", variable->name);
        }
        status = compute(me, roles[variable->role].what);
        if (status != QO_OK) {
            return qo_pass(me, status);
        }
        values[i] = *place(&me->now, variable);
    }
    return QO_ANSWER_OK;
}

qo_answer qo_get_integers(qo_instance *me, const unsigned references[], size_t n, int values[], size_t n_values)
{
    size_t i;
    if (!fits(me, references, n, values, n_values)) {
        return QO_ANSWER_ERROR;
    }
    for (i = 0; i < n; i++) {
        const qo_variable *variable = qo_find(me, references[i]);
        if (variable == NULL) {
            return QO_ANSWER_ERROR;
        }
        if (variable->role != QO_DISCRETE) {
            return qo_tell(me, QO_ANSWER_ERROR, "%s is a real number.", variable->name);
        }
        values[i] = me->now.model.mode;
    }
    return QO_ANSWER_OK;
}

qo_answer qo_no_variables(const qo_instance *me, const char *type, size_t n)
{
    return n == 0 ? QO_ANSWER_OK : qo_tell(me, QO_ANSWER_ERROR, "The model has no %s variables.", type);
}

static int may_set(const qo_instance *me, const qo_variable *variable)
{
    const int modes = roles[variable->role].settable;
    if (modes & me->now.mode) {
        return 1;
    }
    qo_tell(me, QO_ANSWER_ERROR, modes ? "%s cannot be set in the present mode." : "%s cannot be set: it is computed.",
            variable->name);
    return 0;
}

/* Whether the model can be as it is now; `last` was set last. The mode k of (9) follows what is set before the
 * simulation; later it changes at events only. */
static qo_answer settle(qo_instance *me, const qo_variable *last)
{
    int changed;
    const qo_answer answer = qo_pass(me, qo_check(&me->now.model));
    if (answer == QO_ANSWER_OK && (me->now.mode & SETTABLE_STATES) &&
        qo_update_discrete(&me->now.model, &changed) != QO_OK) {
        return qo_tell(me, QO_ANSWER_ERROR, "%s cannot be %g: %s", last->name, *place(&me->now, last),
                       me->now.model.message);
    }
    return answer;
}

qo_answer qo_set(qo_instance *me, const unsigned references[], size_t n, const double values[], size_t n_values)
{
    const qo_model before = me->now.model;
    const qo_variable *variable = NULL;
    qo_answer answer;
    size_t i;
    if (!fits(me, references, n, values, n_values)) {
        return QO_ANSWER_ERROR;
    }
    if (n == 0) {
        return QO_ANSWER_OK;
    }
    for (i = 0; i < n; i++) {
        variable = qo_find(me, references[i]);
        if (variable == NULL || !may_set(me, variable)) {
            me->now.model = before;
            return QO_ANSWER_ERROR;
        }
        *place(&me->now, variable) = values[i];
    }
    answer = settle(me, variable);
    if (answer == QO_ANSWER_OK) {
        me->now.known = 0;
        me->now.follows |= me->now.mode == QO_UPDATING;
    } else {
        me->now.model = before;
    }
    return answer;
}

qo_answer qo_set_input_rates(qo_instance *me, const unsigned references[], size_t n, const int orders[],
                             const double rates[])
{
    const qo_model before = me->now.model;
    size_t i;
    if (!fits(me, references, n, rates, n) || !fits(me, references, n, orders, n)) {
        return QO_ANSWER_ERROR;
    }
    for (i = 0; i < n; i++) {
        const qo_variable *variable = qo_find(me, references[i]);
        const char *objection = variable == NULL                ? NULL
                                : variable->role != QO_INPUT    ? "is no input"
                                : orders[i] != 1                ? "has rates of order 1 only"
                                : rates[i] - rates[i] != 0.0    ? "has a rate that is not finite"
                                                                : "";
        if (objection == NULL || objection[0] != '\0') {
            me->now.model = before;
            return objection == NULL ? QO_ANSWER_ERROR
                                     : qo_tell(me, QO_ANSWER_ERROR, "%s %s.", variable->name, objection);
        }
        me->now.model.ur[variable->index] = rates[i];
    }
    return QO_ANSWER_OK;
}

qo_answer qo_update(qo_instance *me, int *changed)
{
    qo_answer answer;
    *changed = 0;
    answer = qo_pass(me, qo_update_discrete(&me->now.model, changed));
    return answer == QO_ANSWER_OK && *changed ? qo_tell_event(me) : answer;
}

static int solver_fits(const qo_instance *me, const char *what, const void *values, size_t n, size_t expected)
{
    if (n == expected && (values != NULL || n == 0)) {
        return 1;
    }
    qo_tell(me, QO_ANSWER_ERROR, "There are %lu %s, not %lu.", (unsigned long)expected, what, (unsigned long)n);
    return 0;
}

qo_answer qo_set_time(qo_instance *me, double time)
{
    if (time - time != 0.0) {
        return qo_tell(me, QO_ANSWER_ERROR, "time is not a finite number.");
    }
    me->now.time = time;
    return QO_ANSWER_OK;
}

qo_answer qo_get_states(qo_instance *me, double states[], size_t n)
{
    if (!solver_fits(me, "states", states, n, QO_NX)) {
        return QO_ANSWER_ERROR;
    }
    memcpy(states, me->now.model.x, sizeof me->now.model.x);
    return QO_ANSWER_OK;
}

qo_answer qo_set_states(qo_instance *me, const double states[], size_t n)
{
    double before[QO_NX];
    qo_status status;
    if (!solver_fits(me, "states", states, n, QO_NX)) {
        return QO_ANSWER_ERROR;
    }
    memcpy(before, me->now.model.x, sizeof before);
    memcpy(me->now.model.x, states, sizeof before);
    status = qo_check(&me->now.model);
    if (status == QO_OK) {
        me->now.known = 0;
    } else {
        memcpy(me->now.model.x, before, sizeof before);
    }
    return qo_trial(me, status);
}

qo_answer qo_get_derivatives(qo_instance *me, double derivatives[], size_t n)
{
    qo_status status;
    if (!solver_fits(me, "derivatives", derivatives, n, QO_NX)) {
        return QO_ANSWER_ERROR;
    }
    status = compute(me, QO_KNOWN_DERIVATIVES);
    if (status == QO_OK) {
        memcpy(derivatives, me->now.derivatives, sizeof me->now.derivatives);
    }
    return qo_trial(me, status);
}

qo_answer qo_get_nominals(qo_instance *me, double nominals[], size_t n)
{
    if (!solver_fits(me, "nominal values of states", nominals, n, QO_NX)) {
        return QO_ANSWER_ERROR;
    }
    memcpy(nominals, qo_nominals, QO_NX * sizeof nominals[0]);
    return QO_ANSWER_OK;
}

qo_answer qo_get_indicators(qo_instance *me, double indicators[], size_t n)
{
    qo_status status;
    if (!solver_fits(me, "event indicators", indicators, n, QO_NZ)) {
        return QO_ANSWER_ERROR;
    }
    status = compute(me, QO_KNOWN_INDICATORS);
    if (status == QO_OK) {
        memcpy(indicators, me->now.indicators, sizeof me->now.indicators);
    }
    return qo_trial(me, status);
}
