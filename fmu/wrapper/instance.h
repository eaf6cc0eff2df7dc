/* One instance of the model behind the functions of FMI 2.0 and 3.0: modes, values, messages, saved states.
 *
 * A call that is refused (wrong mode, unknown variable, value that is not finite or out of bounds) changes nothing
 * and answers with an error whose message names the variable. A step or a derivative that the model cannot compute
 * answers with `discard`; the state is that from before the call, so the importer may try a smaller step. */
#ifndef QO_INSTANCE_H
#define QO_INSTANCE_H

#include <stddef.h>

#include "core.h"
#include "variables.h"

/* Numbered as fmi2Status and fmi3Status. */
typedef enum { QO_ANSWER_OK, QO_ANSWER_WARNING, QO_ANSWER_DISCARD, QO_ANSWER_ERROR } qo_answer;

typedef enum { QO_MODEL_EXCHANGE, QO_CO_SIMULATION } qo_interface;

/* The modes of both standards, as bits, so that a set of modes is a number. */
typedef enum {
    QO_INSTANTIATED = 1,
    QO_INITIALIZATION = 2,
    QO_EVENT = 4,
    QO_CONTINUOUS_TIME = 8,
    QO_STEP = 16,
    QO_TERMINATED = 32,
    QO_UPDATING = 64 /* within the callback between two internal steps */
} qo_mode;

#define QO_ANY_MODE (QO_INSTANTIATED | QO_INITIALIZATION | QO_EVENT | QO_CONTINUOUS_TIME | QO_STEP | QO_TERMINATED)
#define QO_READABLE (QO_ANY_MODE | QO_UPDATING)
#define QO_RUNNING (QO_EVENT | QO_CONTINUOUS_TIME | QO_STEP)

typedef enum { QO_LOG_ERROR = 1, QO_LOG_DISCARD = 2, QO_LOG_EVENTS = 4 } qo_category;

#define QO_CATEGORIES 3
extern const char *const qo_category_names[QO_CATEGORIES];

typedef struct qo_instance qo_instance;

/* Passes a message on to the importer. */
typedef void (*qo_write)(const qo_instance *me, qo_answer status, const char *category, const char *message);

/* Called after each internal step of a co-simulation step; not zero asks for an early return. */
typedef int (*qo_between)(qo_instance *me);

/* Everything that a saved state holds; no pointer in it. */
typedef struct {
    qo_model model;
    double derivatives[QO_NX];
    double indicators[QO_NZ];
    double fastest; /* time constant [s] */
    double time;
    double stop_time; /* infinite where none is set */
    int mode;         /* of the interface, a qo_mode; k of (9) is in the model */
    int follows;      /* whether the importer sets inputs between internal steps */
    int known;        /* set of QO_KNOWN_...: what belongs to the present x, u and p */
} qo_snapshot;

#define QO_KNOWN_OUTPUTS 1
#define QO_KNOWN_DERIVATIVES 2
#define QO_KNOWN_INDICATORS 4
#define QO_KNOWN_FASTEST 8

struct qo_instance {
    qo_snapshot now;
    qo_interface interface;
    int events_told; /* co-simulation: the importer handles events */
    int categories;  /* set of qo_category that is written */
    char *name;
    void *environment;
    void (*callback)(void);     /* for messages */
    void (*intermediate)(void); /* after internal steps, where the importer asks for it */
    int early_return;           /* whether it may then end the step */
    qo_between between;
    qo_write write;
};

qo_instance *qo_new(qo_interface interface, const char *name, int logging, void *environment,
                    void (*callback)(void), qo_write write);
void qo_free(qo_instance *me);

/* Tells the importer; `answer` is returned, so that a function can end with it. */
qo_answer qo_tell(const qo_instance *me, qo_answer answer, const char *format, ...);

/* Tells that k of (9) is another one. */
qo_answer qo_tell_event(const qo_instance *me);

/* What the model answers, told to the importer. */
qo_answer qo_pass(const qo_instance *me, qo_status status);
/* The same where the importer's solver only tries: it then takes a shorter step. */
qo_answer qo_trial(const qo_instance *me, qo_status status);

qo_answer qo_set_logging(qo_instance *me, int on, size_t n, const char *const categories[]);

/* Whether `function` may be called in the present mode; tells where not. */
int qo_allowed(const qo_instance *me, const char *function, int modes);
int qo_allowed_as(const qo_instance *me, const char *function, qo_interface interface, int modes);

/* What the importer says of an experiment; what it leaves undefined keeps its default. */
typedef struct {
    int has_tolerance;
    double tolerance;
    double start_time;
    int has_stop_time;
    double stop_time;
} qo_experiment;

qo_answer qo_set_up(qo_instance *me, const qo_experiment *experiment);
qo_answer qo_exit_initialization(qo_instance *me, qo_mode next);
qo_answer qo_reset(qo_instance *me);

/* The variable of a value reference; tells where there is none. */
const qo_variable *qo_find(const qo_instance *me, unsigned reference);

qo_answer qo_get(qo_instance *me, const unsigned references[], size_t n, double values[], size_t n_values);
qo_answer qo_set(qo_instance *me, const unsigned references[], size_t n, const double values[], size_t n_values);
qo_answer qo_get_integers(qo_instance *me, const unsigned references[], size_t n, int values[], size_t n_values);
/* Rates of inputs, for the next co-simulation step. */
qo_answer qo_set_input_rates(qo_instance *me, const unsigned references[], size_t n, const int orders[],
                             const double rates[]);
/* References of types that the model has no variables of. */
qo_answer qo_no_variables(const qo_instance *me, const char *type, size_t n);

qo_answer qo_directional(qo_instance *me, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[],
                         size_t n_knowns, const double seed[], size_t n_seed, double result[], size_t n_result);
qo_answer qo_adjoint(qo_instance *me, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[],
                     size_t n_knowns, const double seed[], size_t n_seed, double result[], size_t n_result);
/* First derivatives of outputs with respect to time, inputs held. */
qo_answer qo_output_derivatives(qo_instance *me, const unsigned references[], size_t n, const int orders[],
                                double values[], size_t n_values);

qo_answer qo_set_time(qo_instance *me, double time);
qo_answer qo_get_states(qo_instance *me, double states[], size_t n);
qo_answer qo_set_states(qo_instance *me, const double states[], size_t n);
qo_answer qo_get_derivatives(qo_instance *me, double derivatives[], size_t n);
qo_answer qo_get_nominals(qo_instance *me, double nominals[], size_t n);
qo_answer qo_get_indicators(qo_instance *me, double indicators[], size_t n);
/* k of (9) from the present state; *changed tells whether it is another one now. */
qo_answer qo_update(qo_instance *me, int *changed);

/* How a co-simulation step ended. */
typedef struct {
    double time;
    int event; /* k of (9) is about to change */
    int early;
} qo_step_end;

qo_answer qo_do_step(qo_instance *me, double time, double size, qo_step_end *end);

qo_answer qo_save(qo_instance *me, void **state);
qo_answer qo_restore(qo_instance *me, const void *state);
qo_answer qo_forget(qo_instance *me, void **state);
size_t qo_serialized_size(void);
qo_answer qo_serialize(qo_instance *me, const void *state, char bytes[], size_t size);
qo_answer qo_deserialize(qo_instance *me, const char bytes[], size_t size, void **state);

#endif
