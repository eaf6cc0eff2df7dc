/* Saved states: in memory, and as bytes that tell when they are damaged. */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"

/* A saved state is a snapshot behind a mark, so that what another model or version has saved is refused. */
typedef struct {
    char mark[QO_MARK_SIZE];
    qo_snapshot snapshot;
} saved;

static int is_saved(const qo_instance *me, const saved *state)
{
    if (state == NULL || memcmp(state->mark, qo_mark, QO_MARK_SIZE) != 0) {
        qo_tell(me, QO_ANSWER_ERROR, "That is no saved state of this model.");
        return 0;
    }
    return 1;
}

qo_answer qo_save(qo_instance *me, void **state)
{
    saved *copy;
    if (state == NULL || (*state != NULL && !is_saved(me, *state))) {
        return qo_tell(me, QO_ANSWER_ERROR, "There is no place to save the state to.");
    }
    copy = *state == NULL ? malloc(sizeof *copy) : *state;
    if (copy == NULL) {
        return qo_tell(me, QO_ANSWER_ERROR, "There is no memory for a saved state.");
    }
    memcpy(copy->mark, qo_mark, QO_MARK_SIZE);
    memcpy(&copy->snapshot, &me->now, sizeof copy->snapshot);
    *state = copy;
    return QO_ANSWER_OK;
}

qo_answer qo_restore(qo_instance *me, const void *state)
{
    const saved *copy = state;
    const qo_mode foreign = me->interface == QO_CO_SIMULATION ? QO_CONTINUOUS_TIME : QO_STEP;
    if (!is_saved(me, copy)) {
        return QO_ANSWER_ERROR;
    }
    if (copy->snapshot.mode == (int)foreign) {
        return qo_tell(me, QO_ANSWER_ERROR, "That state was saved in %s.",
                       foreign == QO_STEP ? "co-simulation" : "model exchange");
    }
    memcpy(&me->now, &copy->snapshot, sizeof me->now);
    return QO_ANSWER_OK;
}

qo_answer qo_forget(qo_instance *me, void **state)
{
    if (state == NULL || *state == NULL) {
        return QO_ANSWER_OK;
    }
    if (!is_saved(me, *state)) {
        return QO_ANSWER_ERROR;
    }
    free(*state);
    *state = NULL;
    return QO_ANSWER_OK;
}

/* The saved state as bytes, behind it what they sum up to: they may lie on a disk or cross a network. */
typedef struct {
    saved state;
    uint64_t checksum;
} serialized;

/* FNV-1a; as each round can be undone, no change of a single byte keeps it. */
static uint64_t checksum_of(const saved *state)
{
    const unsigned char *bytes = (const unsigned char *)state;
    uint64_t sum = UINT64_C(14695981039346656037);
    size_t i;
    for (i = 0; i < sizeof *state; i++) {
        sum = (sum ^ bytes[i]) * UINT64_C(1099511628211);
    }
    return sum;
}

size_t qo_serialized_size(void)
{
    return sizeof(serialized);
}

qo_answer qo_serialize(qo_instance *me, const void *state, char bytes[], size_t size)
{
    uint64_t sum;
    if (!is_saved(me, state)) {
        return QO_ANSWER_ERROR;
    }
    if (bytes == NULL || size < sizeof(serialized)) {
        return qo_tell(me, QO_ANSWER_ERROR, "A saved state takes %lu bytes.", (unsigned long)sizeof(serialized));
    }
    sum = checksum_of(state);
    memcpy(bytes, state, sizeof(saved));
    memcpy(bytes + offsetof(serialized, checksum), &sum, sizeof sum);
    return QO_ANSWER_OK;
}

/* Bytes may come from anywhere, with a checksum that fits: a snapshot that no instance can have written is refused, and what it claims to have
 * computed is computed again. */
static int is_sound(qo_snapshot *snapshot)
{
    const int mode = snapshot->mode, k = snapshot->model.mode;
    const double tolerance = snapshot->model.tolerance;
    snapshot->model.message[QO_MESSAGE_SIZE - 1] = '\0';
    snapshot->known = 0;
    return mode > 0 && (mode & QO_ANY_MODE) == mode && (mode & (mode - 1)) == 0 && snapshot->time - snapshot->time == 0.0 &&
           k >= 1 && k <= 4 && tolerance > 0.0 && tolerance < 1.0 && qo_check(&snapshot->model) == QO_OK;
}

/* What is wrong with bytes, NULL where nothing is. */
static const char *flaw(serialized *copy)
{
    if (memcmp(copy->state.mark, qo_mark, QO_MARK_SIZE) != 0) {
        return "These bytes are no saved state of this model, but of another model, version or build.";
    }
    if (copy->checksum != checksum_of(&copy->state)) {
        return "This saved state is damaged: its checksum is another one. Save it again.";
    }
    return is_sound(&copy->state.snapshot) ? NULL : "These bytes are no saved state that this model can have had.";
}

qo_answer qo_deserialize(qo_instance *me, const char bytes[], size_t size, void **state)
{
    serialized copy;
    saved *own;
    const char *objection;
    if (state == NULL || bytes == NULL || size != sizeof copy) {
        return qo_tell(me, QO_ANSWER_ERROR, "A saved state of this model takes %lu bytes, these are %lu.",
                       (unsigned long)sizeof copy, (unsigned long)(bytes == NULL ? 0 : size));
    }
    memcpy(&copy, bytes, sizeof copy);
    objection = flaw(&copy);
    if (objection != NULL) {
        return qo_tell(me, QO_ANSWER_ERROR, "%s", objection);
    }
    own = malloc(sizeof *own);
    if (own == NULL) {
        return qo_tell(me, QO_ANSWER_ERROR, "There is no memory for a saved state.");
    }
    *own = copy.state;
    *state = own;
    return QO_ANSWER_OK;
}
