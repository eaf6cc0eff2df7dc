/* The integrator: a Rosenbrock method, linearly implicit, stiffly accurate and L-stable, with step size control.
 *
 * Rodas3 of A. Sandu et al., Benchmarking stiff ODE solvers for atmospheric chemistry problems II: Rosenbrock
 * solvers, Atmospheric Environment 31 (1997) 3459-3472: four stages, order 3, embedded order 2. In the form without
 * products by the Jacobian (Hairer, Wanner, Solving Ordinary Differential Equations II, section IV.7) stage i solves
 *
 *     (I/(g h) - J) k_i = f(x + sum a_j k_j) + sum c_ij k_j / h
 *
 * with sums over the stages j before i. Of this method each k has the same part in all arguments after it.
 */
#include <math.h>
#include <string.h>

#include "core.h"
#include "qo_equations.h"
#include "qo_internal.h"
#include "qo_linear.h"

#define STAGES 4
#define MAX_INTERNAL_STEPS 20000
#define LONGEST_STEP 1e3
#define SHORTEST_STEP 1e-15
#define NEGLIGIBLE 1e-30
/* Part of a state's size in the bound of its error. Small: the slip of a wheel is a small difference of large rates,
   and an error of it beyond what a contact sticks in makes steps bounce between its two sides. */
#define RELATIVE_PART 0.01

/* After inputs that jump: how much longer than the step that was right after the last jump the next one may be. */
#define BOLDER 1.2

/* Part of the length tried, below which what is proposed after a refusal tells a jump of another kind. */
#define UNLIKE 0.5

static const double GAMMA = 0.5;
/* Part of each k in the argument of all stages after it, and in the state at the end; the error is the last k. */
static const double A[STAGES] = {2.0, 0.0, 1.0, 1.0};
static const double C[STAGES][STAGES] = {{0.0}, {4.0}, {1.0, -1.0}, {1.0, -1.0, -8.0 / 3.0}};
/* Whether a stage has an argument of its own; the second one shares that of the first. */
static const int EVALUATES[STAGES] = {1, 0, 1, 1};
/* Where in the step a stage sees the inputs, and how much of what their rates change in the derivatives it adds. */
static const double MOMENT[STAGES] = {0.0, 0.0, 1.0, 1.0};
static const double DRIFT[STAGES] = {0.5, 1.5, 0.0, 0.0};
static const double ORDER_OF_ERROR = 3.0;

/* Where a step begins. */
typedef struct {
    double slope[QO_NX]; /* of the states */
    double drift[QO_NX]; /* of the slope, by the inputs alone */
    int ramps;           /* whether any input has a rate */
} departure;

static void add_scaled(double *sum, const double *values, double weight) {
    int index;
    for (index = 0; index < QO_NX; ++index) {
        sum[index] += weight * values[index];
    }
}

static void add(double *sum, const double *weights, double (*k)[QO_NX], int count, double scale) {
    int stage;
    for (stage = 0; stage < count; ++stage) {
        double weight = weights[stage] * scale;
        if (weight != 0.0) {
            add_scaled(sum, k[stage], weight);
        }
    }
}

/* Of each state the sizes of the effects that it is there for, -1 behind; of the generated table. */
extern const int qo_felt_by[QO_NX][QO_NE];

/* Whether a state that is there for the sake of effects has none. Then nothing depends on it, or it is the twist of a
   spring so stiff that both ends move as one; it follows as the method lets it, without asking for shorter steps. */
static int idle(const qo_model *model, int state) {
    int index, effects = 0;
    for (index = 0; index < QO_NE && qo_felt_by[state][index] >= 0; ++index) {
        if (model->p[qo_felt_by[state][index]] != 0.0) {
            return 0;
        }
        ++effects;
    }
    return effects > 0;
}

/* Largest part of the error over its bound; *worst is the state that has it. */
static double error_ratio(const qo_model *model, const double *next, const double *error, int *worst) {
    double largest = 0.0;
    int index;
    for (index = 0; index < QO_NX; ++index) {
        double size = fmax(fabs(model->x[index]), fabs(next[index]));
        double ratio = fabs(error[index]) / (model->tolerance * (qo_states[index].nominal + RELATIVE_PART * size));
        if (!isfinite(next[index]) || !isfinite(ratio)) {
            *worst = index;
            return INFINITY;
        }
        if (ratio > largest && !idle(model, index)) {
            largest = ratio;
            *worst = index;
        }
    }
    return largest;
}

static void inputs_after(const qo_model *model, double h, double *u) {
    int index;
    for (index = 0; index < QO_NU; ++index) {
        u[index] = model->u[index] + h * model->ur[index];
    }
}

static departure depart(const qo_model *model, qo_linear *system) {
    departure from;
    int index;
    qo_eq_linearize(model->x, model->u, model->p, from.slope, system->jacobian);
    from.ramps = 0;
    for (index = 0; index < QO_NU; ++index) {
        from.ramps |= model->ur[index] != 0.0;
    }
    if (from.ramps) {
        qo_eq_input_direction(model->x, model->u, model->p, model->ur, from.drift);
    }
    return from;
}

static void evaluate(const qo_model *model, const departure *from, const double *argument, double h, double *slope) {
    double u[QO_NU];
    if (from->ramps) {
        inputs_after(model, h, u);
    }
    qo_eq_derivatives(argument, from->ramps ? u : model->u, model->p, slope);
}

/* A step of h: the state after it, and its error ratio. */
static double attempt(const qo_model *model, qo_linear *system, const departure *from, double h, double *next,
                      int *worst) {
    double k[STAGES][QO_NX];
    double slope[QO_NX];
    int stage;
    if (!qo_prepare(system, 1.0 / (GAMMA * h))) {
        *worst = 0;
        return INFINITY;
    }
    memcpy(next, model->x, QO_NX * sizeof *next);
    memcpy(slope, from->slope, sizeof slope);
    for (stage = 0; stage < STAGES; ++stage) {
        double right[QO_NX];
        if (EVALUATES[stage] && stage > 0) {
            evaluate(model, from, next, MOMENT[stage] * h, slope);
        }
        memcpy(right, slope, sizeof right);
        add(right, C[stage], k, stage, 1.0 / h);
        if (from->ramps) {
            add_scaled(right, from->drift, DRIFT[stage] * h);
        }
        qo_solve(system, right, k[stage]);
        if (A[stage] != 0.0) {
            add_scaled(next, k[stage], A[stage]);
        }
    }
    return error_ratio(model, next, k[STAGES - 1], worst);
}

/* Factor on the step length after an error ratio. */
static double growth(double ratio) {
    if (!isfinite(ratio)) {
        return 0.1;
    }
    return fmin(5.0, fmax(0.1, 0.9 * pow(fmax(ratio, 1e-8), -1.0 / ORDER_OF_ERROR)));
}

/* A vehicle at rest decays into numbers that processors handle slowly; they mean nothing. */
static void flush(double *x) {
    int index;
    for (index = 0; index < QO_NX; ++index) {
        if (fabs(x[index]) < NEGLIGIBLE) {
            x[index] = 0.0;
        }
    }
}

static qo_status give_up(qo_model *model, int worst) {
    return qo_fail(model, QO_DISCARD, "However short the step, state ", qo_states[worst].name,
                   " is not accurate.");
}

/* What inputs that jump excite decays: the steps after it grow from one to the next, and alike after every jump. So each
   of the first has a length of its own, from the last time. */
static double first_guess(qo_model *model) {
    if (memcmp(model->u, model->last_u, sizeof model->u) != 0) {
        model->since_jump = 0;
    }
    return model->since_jump < QO_AFTER_JUMP ? model->after_jump[model->since_jump] : model->step;
}

/* A step that was cut short by the end of the communication step says nothing against a longer one. */
static double learned(double before, double tried, double proposed) {
    return fmin(tried < before ? fmax(proposed, before) : proposed, LONGEST_STEP);
}

static void learn(qo_model *model, double tried, double proposed) {
    model->step = learned(model->step, tried, proposed);
    if (model->since_jump < QO_AFTER_JUMP) {
        double *own = &model->after_jump[model->since_jump];
        *own = fmin(learned(*own, tried, proposed), BOLDER * fmax(tried, *own));
        model->since_jump += 1;
    }
}

/* After a step that was refused. By much: this jump is not like the last ones, and their lengths say nothing here. */
static void forget(qo_model *model, double tried, double proposed) {
    if (model->since_jump < QO_AFTER_JUMP) {
        model->after_jump[model->since_jump] = proposed;
        if (proposed < UNLIKE * tried) {
            model->since_jump = QO_AFTER_JUMP;
        }
    }
}

/* One step of at most h that the tolerance accepts; y stays. */
static qo_status integrate(qo_model *model, double h, double *taken) {
    qo_linear system;
    const departure from = depart(model, &system);
    double next[QO_NX];
    double tried = fmin(fmax(first_guess(model), SHORTEST_STEP), h);
    int worst = 0, rejected = 0;
    for (;;) {
        double ratio = attempt(model, &system, &from, tried, next, &worst);
        double proposed = tried * (ratio <= 1.0 && rejected ? fmin(1.0, growth(ratio)) : growth(ratio));
        if (ratio <= 1.0) {
            learn(model, tried, proposed);
            *taken = tried;
            flush(next);
            memcpy(model->x, next, sizeof next);
            inputs_after(model, tried, model->u);
            memcpy(model->last_u, model->u, sizeof model->u);
            return QO_OK;
        }
        forget(model, tried, proposed);
        rejected = 1;
        model->step = tried = proposed;
        if (tried < SHORTEST_STEP) {
            return give_up(model, worst);
        }
    }
}

static qo_status check_length(qo_model *model, double h) {
    if (!isfinite(h) || h <= 0.0) {
        return qo_fail(model, QO_ERROR, "The length of the ", "step", " must be greater than zero.");
    }
    return qo_check(model);
}

qo_status qo_advance(qo_model *model, double h, double *taken) {
    qo_model before = *model;
    qo_status status = check_length(model, h);
    if (status == QO_OK && (status = integrate(model, h, taken)) == QO_OK) {
        status = qo_outputs_after_step(model);
    }
    if (status != QO_OK) {
        memcpy(before.message, model->message, sizeof before.message);
        *model = before;
    }
    return status;
}

/* What is left of h; the last step ends at h exactly, and is not a splinter of rounding. */
static qo_status integrate_all(qo_model *model, double h) {
    double done = 0.0;
    int count;
    for (count = 0; count < MAX_INTERNAL_STEPS; ++count) {
        double taken = 0.0;
        qo_status status = integrate(model, h - done, &taken);
        if (status != QO_OK) {
            return status;
        }
        done += taken;
        if (h - done <= 1e-12 * h) {
            return QO_OK;
        }
    }
    return qo_fail(model, QO_DISCARD, "The ", "step", " takes too many internal steps: shorten it.");
}

qo_status qo_step(qo_model *model, double h) {
    qo_model before = *model;
    int changed;
    qo_status status = check_length(model, h);
    if (status == QO_OK && (status = integrate_all(model, h)) == QO_OK &&
        (status = qo_outputs_after_step(model)) == QO_OK) {
        status = qo_mode_after_step(model, &changed);
    }
    if (status != QO_OK) {
        memcpy(before.message, model->message, sizeof before.message);
        *model = before;
    }
    return status;
}
