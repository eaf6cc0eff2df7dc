/* Life of an instance: creation, messages, modes, saved states. */
#include "instance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MESSAGE_SIZE 512

const char *const qo_category_names[QO_CATEGORIES] = {"logStatusError", "logStatusDiscard", "logEvents"};

static const struct {
    qo_mode mode;
    const char *name;
} mode_names[] = {
    {QO_INSTANTIATED, "before initialization"}, {QO_INITIALIZATION, "in initialization mode"},
    {QO_EVENT, "in event mode"},                {QO_CONTINUOUS_TIME, "in continuous-time mode"},
    {QO_STEP, "in step mode"},                  {QO_TERMINATED, "after termination"},
    {QO_UPDATING, "in intermediate update"},
};

static int is_finite(double value)
{
    return value - value == 0.0;
}

qo_instance *qo_new(qo_interface interface, const char *name, int logging, void *environment,
                    void (*callback)(void), qo_write write)
{
    size_t length = name == NULL ? 0 : strlen(name);
    qo_instance *me = calloc(1, sizeof *me);
    if (me == NULL) {
        return NULL;
    }
    me->name = malloc(length + 1);
    if (me->name == NULL) {
        free(me);
        return NULL;
    }
    if (length > 0) {
        memcpy(me->name, name, length);
    }
    me->name[length] = '\0';
    me->interface = interface;
    me->environment = environment;
    me->callback = callback;
    me->write = write;
    qo_set_logging(me, logging, 0, NULL);
    qo_reset(me);
    if (interface == QO_MODEL_EXCHANGE && !QO_MODEL_EXCHANGED) {
        qo_tell(me, QO_ANSWER_ERROR, "This FMU is for co-simulation alone.");
        qo_free(me);
        return NULL;
    }
    return me;
}

void qo_free(qo_instance *me)
{
    if (me != NULL) {
        free(me->name);
        free(me);
    }
}

static qo_category category_of(qo_answer answer)
{
    switch (answer) {
    case QO_ANSWER_OK: return QO_LOG_EVENTS;
    case QO_ANSWER_DISCARD: return QO_LOG_DISCARD;
    default: return QO_LOG_ERROR;
    }
}

qo_answer qo_tell(const qo_instance *me, qo_answer answer, const char *format, ...)
{
    qo_category category = category_of(answer);
    int index = 0;
    char message[MESSAGE_SIZE];
    va_list arguments;
    if (me->callback == NULL || !(me->categories & category)) {
        return answer;
    }
    while (category >> index != 1) {
        index++;
    }
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    me->write(me, answer, qo_category_names[index], message);
    return answer;
}

qo_answer qo_tell_event(const qo_instance *me)
{
    return qo_tell(me, QO_ANSWER_OK, "The motion mode is %d from %.9g s on.", me->now.model.mode, me->now.time);
}

qo_answer qo_pass(const qo_instance *me, qo_status status)
{
    static const qo_answer answers[] = {QO_ANSWER_OK, QO_ANSWER_DISCARD, QO_ANSWER_ERROR};
    return status == QO_OK ? QO_ANSWER_OK : qo_tell(me, answers[status], "%s", me->now.model.message);
}

qo_answer qo_trial(const qo_instance *me, qo_status status)
{
    return status == QO_OK ? QO_ANSWER_OK : qo_tell(me, QO_ANSWER_DISCARD, "%s", me->now.model.message);
}

/* An importer that asks for silence still wants to know why a call was refused or a step discarded. */
qo_answer qo_set_logging(qo_instance *me, int on, size_t n, const char *const categories[])
{
    int chosen = 0, category;
    size_t i;
    for (i = 0; i < n; i++) {
        for (category = 0; category < QO_CATEGORIES; category++) {
            if (categories[i] != NULL && strcmp(categories[i], qo_category_names[category]) == 0) {
                break;
            }
        }
        if (category == QO_CATEGORIES) {
            return qo_tell(me, QO_ANSWER_ERROR, "There is no log category \"%s\".",
                           categories[i] == NULL ? "" : categories[i]);
        }
        chosen |= 1 << category;
    }
    chosen = n == 0 ? (1 << QO_CATEGORIES) - 1 : chosen;
    me->categories = (on ? chosen : 0) | QO_LOG_ERROR | QO_LOG_DISCARD;
    return QO_ANSWER_OK;
}

int qo_allowed(const qo_instance *me, const char *function, int modes)
{
    size_t i;
    const char *now = "in an unknown mode";
    if (me->now.mode & modes) {
        return 1;
    }
    for (i = 0; i < sizeof mode_names / sizeof mode_names[0]; i++) {
        now = me->now.mode == (int)mode_names[i].mode ? mode_names[i].name : now;
    }
    qo_tell(me, QO_ANSWER_ERROR, "%s may not be called %s.", function, now);
    return 0;
}

int qo_allowed_as(const qo_instance *me, const char *function, qo_interface interface, int modes)
{
    if (me->interface != interface) {
        qo_tell(me, QO_ANSWER_ERROR, "%s is a function of %s; this instance is for %s.", function,
                interface == QO_CO_SIMULATION ? "co-simulation" : "model exchange",
                interface == QO_CO_SIMULATION ? "model exchange" : "co-simulation");
        return 0;
    }
    return qo_allowed(me, function, modes);
}

qo_answer qo_set_up(qo_instance *me, const qo_experiment *experiment)
{
    const double start = experiment->start_time, stop = experiment->stop_time;
    if (!is_finite(start)) {
        return qo_tell(me, QO_ANSWER_ERROR, "startTime is not a finite number.");
    }
    if (experiment->has_stop_time && !(stop >= start)) {
        return qo_tell(me, QO_ANSWER_ERROR, "stopTime is before startTime %.17g, or no number.", start);
    }
    if (experiment->has_tolerance && !(experiment->tolerance > 0.0 && experiment->tolerance < 1.0)) {
        return qo_tell(me, QO_ANSWER_ERROR, "tolerance must be above 0 and below 1.");
    }
    me->now.time = start;
    me->now.stop_time = experiment->has_stop_time ? stop : HUGE_VAL;
    if (experiment->has_tolerance) {
        me->now.model.tolerance = experiment->tolerance;
    }
    return QO_ANSWER_OK;
}

qo_answer qo_exit_initialization(qo_instance *me, qo_mode next)
{
    int changed;
    qo_answer answer = qo_update(me, &changed);
    if (answer == QO_ANSWER_OK) {
        me->now.mode = (int)next;
    }
    return answer;
}

qo_answer qo_reset(qo_instance *me)
{
    memset(&me->now, 0, sizeof me->now);
    qo_init(&me->now.model);
    me->now.stop_time = HUGE_VAL;
    me->now.mode = QO_INSTANTIATED;
    return QO_ANSWER_OK;
}
