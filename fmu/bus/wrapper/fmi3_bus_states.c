/* Saved states of devices on a bus are copies; what has been saved as bytes could not be trusted, so there is none. */
#include <stdlib.h>
#include <string.h>

#include "fmi3_bus.h"

typedef struct {
    unsigned char mark[QO_MARK_SIZE];
    qo_snapshot plant;
    qb_state bus;
} saved_bus;

static int is_saved_bus(const qo_instance *me, const saved_bus *state)
{
    if (state == NULL || memcmp(state->mark, qo_mark, QO_MARK_SIZE) != 0) {
        qo_tell(me, QO_ANSWER_ERROR, "That is no saved state of this model.");
        return 0;
    }
    return 1;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    saved_bus *copy;
    BUS(fmi3GetFMUState, QO_ANY_MODE)
    GIVEN(FMUState)
    if (*FMUState != NULL && !is_saved_bus(me, *FMUState)) {
        return fmi3Error;
    }
    copy = *FMUState == NULL ? malloc(sizeof *copy) : *FMUState;
    if (copy == NULL) {
        return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "There is no memory for a saved state.");
    }
    memcpy(copy->mark, qo_mark, QO_MARK_SIZE);
    copy->plant = me->now;
    copy->bus = bus->now;
    *FMUState = copy;
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    const saved_bus *copy = FMUState;
    BUS(fmi3SetFMUState, QO_ANY_MODE)
    if (!is_saved_bus(me, copy)) {
        return fmi3Error;
    }
    me->now = copy->plant;
    bus->now = copy->bus;
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    INSTANCE(fmi3FreeFMUState, QO_ANY_MODE)
    if (FMUState != NULL && *FMUState != NULL) {
        if (!is_saved_bus(me, *FMUState)) {
            return fmi3Error;
        }
        free(*FMUState);
        *FMUState = NULL;
    }
    return fmi3OK;
}

static fmi3Status no_bytes(const qo_instance *me)
{
    return (fmi3Status)qo_tell(me, QO_ANSWER_ERROR, "States of this model are not saved as bytes.");
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    INSTANCE(fmi3SerializedFMUStateSize, QO_ANY_MODE)
    (void)FMUState, (void)size;
    return no_bytes(me);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    INSTANCE(fmi3SerializeFMUState, QO_ANY_MODE)
    (void)FMUState, (void)serializedState, (void)size;
    return no_bytes(me);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    INSTANCE(fmi3DeserializeFMUState, QO_ANY_MODE)
    (void)FMUState, (void)serializedState, (void)size;
    return no_bytes(me);
}
