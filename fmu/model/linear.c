/* The linear systems of the integrator.
 *
 * Only the first states, the rates of chassis and steering, are coupled densely; the others hang on them and are
 * eliminated before and after, by generated code. What is left are QO_NV equations.
 */
#include "qo_linear.h"

#include <math.h>
#include <string.h>

#include "qo_equations.h"

/* LU decomposition with row pivoting, in place; the diagonal has its inverses. Whether there is one. */
static int decompose(qo_linear *system) {
    int column, row, k;
    for (column = 0; column < QO_NV; ++column) {
        int best = column;
        for (row = column + 1; row < QO_NV; ++row) {
            if (fabs(system->matrix[row][column]) > fabs(system->matrix[best][column])) {
                best = row;
            }
        }
        system->pivot[column] = best;
        if (best != column) {
            double held[QO_NV];
            memcpy(held, system->matrix[column], sizeof held);
            memcpy(system->matrix[column], system->matrix[best], sizeof held);
            memcpy(system->matrix[best], held, sizeof held);
        }
        if (!(fabs(system->matrix[column][column]) > 0.0)) {
            return 0;
        }
        system->matrix[column][column] = 1.0 / system->matrix[column][column];
        for (row = column + 1; row < QO_NV; ++row) {
            double factor = system->matrix[row][column] * system->matrix[column][column];
            system->matrix[row][column] = factor;
            for (k = column + 1; k < QO_NV; ++k) {
                system->matrix[row][k] -= factor * system->matrix[column][k];
            }
        }
    }
    return 1;
}

static void substitute(const qo_linear *system, double *v) {
    int row, k;
    for (row = 0; row < QO_NV; ++row) {
        double held = v[system->pivot[row]];
        v[system->pivot[row]] = v[row];
        v[row] = held;
    }
    for (row = 0; row < QO_NV; ++row) {
        double sum = v[row];
        for (k = 0; k < row; ++k) {
            sum -= system->matrix[row][k] * v[k];
        }
        v[row] = sum;
    }
    for (row = QO_NV - 1; row >= 0; --row) {
        double sum = v[row];
        for (k = row + 1; k < QO_NV; ++k) {
            sum -= system->matrix[row][k] * v[k];
        }
        v[row] = sum * system->matrix[row][row];
    }
}

int qo_prepare(qo_linear *system, double shift) {
    qo_eq_factorize(system->jacobian, &shift, system->factors, &system->matrix[0][0]);
    return decompose(system);
}

void qo_solve(const qo_linear *system, const double *right, double *solution) {
    double reduced[QO_NX];
    qo_eq_eliminate(system->factors, right, reduced);
    substitute(system, reduced);
    qo_eq_expand(system->factors, reduced, solution);
}
