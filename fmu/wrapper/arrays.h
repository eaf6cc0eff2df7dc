/* Arrays of the four wheels: other names for scalars. Their value references follow those of the scalars. */
#ifndef QO_ARRAYS_H
#define QO_ARRAYS_H

#include "instance.h"

#define QO_WHEELS 4

typedef struct {
    const char *name;
    unsigned members[QO_WHEELS];
} qo_array;

extern const size_t qo_array_count;
extern const qo_array qo_arrays[];

/* References that an importer gave, with the scalars of every array in its place. */
typedef struct {
    const unsigned *references;
    const int *orders; /* of derivatives, one for each of `references`; NULL where none were given */
    size_t n;
    void *memory; /* NULL where there was no array */
} qo_scalars;

/* Whether it succeeded; tells where not. What succeeded must be freed by qo_scalars_free. */
int qo_scalars_of(const qo_instance *me, const unsigned references[], const int orders[], size_t n,
                  qo_scalars *found);
void qo_scalars_free(qo_scalars *found);

/* Whether all arrays among the references are inputs; tells where not. */
int qo_settable_arrays(const qo_instance *me, const unsigned references[], size_t n);

#endif
