/* Arrays of the four wheels, taken apart into scalars before the model sees them. */
#include "arrays.h"

#include <stdint.h>
#include <stdlib.h>

static const qo_array *array_of(unsigned reference)
{
    return reference < QO_VARIABLES || reference - QO_VARIABLES >= qo_array_count
               ? NULL
               : &qo_arrays[reference - QO_VARIABLES];
}

static size_t count_arrays(const unsigned references[], size_t n)
{
    size_t i, count = 0;
    for (i = 0; references != NULL && i < n; i++) {
        count += array_of(references[i]) != NULL;
    }
    return count;
}

int qo_scalars_of(const qo_instance *me, const unsigned references[], const int orders[], size_t n,
                  qo_scalars *found)
{
    const size_t arrays = count_arrays(references, n), total = n + (QO_WHEELS - 1) * arrays;
    unsigned *flat;
    int *flat_orders;
    size_t i, done = 0;
    found->references = references;
    found->orders = orders;
    found->n = n;
    found->memory = NULL;
    if (arrays == 0) {
        return 1;
    }
    found->memory = total > SIZE_MAX / (sizeof *flat + sizeof *flat_orders)
                        ? NULL
                        : malloc(total * (sizeof *flat + sizeof *flat_orders));
    if (found->memory == NULL) {
        qo_tell(me, QO_ANSWER_ERROR, "There is no memory for the scalars of arrays.");
        return 0;
    }
    flat = found->memory;
    flat_orders = (int *)(flat + total);
    for (i = 0; i < n; i++) {
        const qo_array *array = array_of(references[i]);
        const size_t members = array == NULL ? 1 : QO_WHEELS;
        size_t member;
        for (member = 0; member < members; member++, done++) {
            flat[done] = array == NULL ? references[i] : array->members[member];
            flat_orders[done] = orders == NULL ? 0 : orders[i];
        }
    }
    found->references = flat;
    found->orders = orders == NULL ? NULL : flat_orders;
    found->n = total;
    return 1;
}

void qo_scalars_free(qo_scalars *found)
{
    free(found->memory);
}

int qo_settable_arrays(const qo_instance *me, const unsigned references[], size_t n)
{
    size_t i;
    for (i = 0; references != NULL && i < n; i++) {
        const qo_array *array = array_of(references[i]);
        if (array != NULL && qo_variables[array->members[0]].role != QO_INPUT) {
            qo_tell(me, QO_ANSWER_ERROR, "%s cannot be set: it is an output. Start values are those of its scalars.",
                    array->name);
            return 0;
        }
    }
    return 1;
}
