/* The co-simulation step: through the model's own solver, stopping at events where the importer wants to know. */
#include <math.h>
#include <string.h>

#include "instance.h"

/* Instants closer than this share of a step are one: importers add up rounding errors. */
#define SAME_INSTANT 1e-6

/* To what an event is told to lie [s]. */
#define EVENT_RESOLUTION 1e-6

/* Share of a step that is left over by rounding alone. */
#define SPLINTER 1e-12

/* How long an input is held where the importer sets it between internal steps [s]. */
#define LONGEST_HOLD 2e-3

/* Internal steps of one communication step, with those of the search for its event. */
#define MOST_STEPS 50000

static double rounding(double time)
{
    return 1e-12 * fabs(time);
}

static qo_answer check(const qo_instance *me, double time, double size)
{
    const double slack = SAME_INSTANT * size + rounding(time);
    if (!(size > 0.0 && fabs(time + size) < HUGE_VAL)) {
        return qo_tell(me, QO_ANSWER_ERROR, "communicationStepSize must be a positive number; the step must end at a finite time.");
    }
    if (!(fabs(time) < HUGE_VAL && fabs(time - me->now.time) <= slack)) {
        return qo_tell(me, QO_ANSWER_ERROR, "currentCommunicationPoint must be %.17g, where the last step ended.",
                       me->now.time);
    }
    if (time + size > me->now.stop_time + slack) {
        return qo_tell(me, QO_ANSWER_ERROR, "communicationStepSize leads beyond stopTime %.17g.", me->now.stop_time);
    }
    return QO_ANSWER_OK;
}

/* Whether k of (9) would be another one now. */
static qo_status look_for_event(const qo_model *model, int *event)
{
    qo_model copy = *model;
    return qo_update_discrete(&copy, event);
}

/* An input that the importer sets between internal steps is held no longer than promised. */
static double longest_step(const qo_instance *me, double longest)
{
    return me->now.follows ? fmin(longest, LONGEST_HOLD) : longest;
}

/* What the importer does between two internal steps; whether it asks to end the step. */
static int update(qo_instance *me)
{
    int early;
    me->now.known = QO_KNOWN_OUTPUTS;
    me->now.mode = QO_UPDATING;
    early = me->between(me);
    me->now.mode = QO_STEP;
    return early;
}

/* Internal steps up to `size`, or to an event, or to where the importer asks to return, where it allows that. */
static qo_answer advance(qo_instance *me, double time, double size, qo_step_end *end)
{
    qo_model *model = &me->now.model;
    double done = 0.0, longest = size;
    int changed, count;
    for (count = 0; done < size && !end->early; count++) {
        const qo_model before = *model;
        double taken;
        qo_status status = qo_advance(model, fmin(longest_step(me, longest), size - done), &taken);
        if (status == QO_OK) {
            status = me->events_told ? look_for_event(model, &end->event) : qo_update_discrete(model, &changed);
        }
        if (status != QO_OK) {
            return qo_pass(me, status);
        }
        if (count == MOST_STEPS) {
            return qo_tell(me, QO_ANSWER_DISCARD, "The step takes too many internal steps: shorten it.");
        }
        if (end->event && me->early_return && taken > EVENT_RESOLUTION) {
            *model = before;
            longest = taken / 2;
            continue;
        }
        longest = 2 * taken;
        done = size - done - taken > SPLINTER * size ? done + taken : size;
        me->now.time = end->time = time + done;
        end->early = end->event && me->early_return;
        if (me->between != NULL) {
            end->early |= update(me);
        }
        end->early &= done < size;
    }
    return QO_ANSWER_OK;
}

qo_answer qo_do_step(qo_instance *me, double time, double size, qo_step_end *end)
{
    const qo_model before = me->now.model;
    const double before_time = me->now.time;
    qo_answer answer;
    end->time = me->now.time;
    end->event = end->early = 0;
    if (check(me, time, size) != QO_ANSWER_OK) {
        return QO_ANSWER_ERROR;
    }
    if (me->events_told || me->between != NULL) {
        answer = advance(me, time, size, end);
    } else {
        answer = qo_pass(me, qo_step(&me->now.model, size));
        end->time = time + size;
    }
    if (answer != QO_ANSWER_OK) {
        me->now.model = before;
        me->now.time = end->time = before_time;
        me->now.known = 0;
        return answer;
    }
    memset(me->now.model.ur, 0, sizeof me->now.model.ur);
    me->now.time = end->time;
    me->now.known = me->between == NULL ? QO_KNOWN_OUTPUTS : 0;
    return me->now.model.mode == before.mode ? QO_ANSWER_OK : qo_tell_event(me);
}
