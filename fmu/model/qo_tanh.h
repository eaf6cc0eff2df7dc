/* tanh for the generated equations, in half the time of a C library's: friction has one for every joint, and asks for
 * them three times in each internal step.
 *
 * Below 0.4 its continued fraction x/(1 + x^2/(3 + x^2/(5 + ...))) after seven terms, written as one quotient: the rest
 * is x^14/(15 (13!!)^2), 1e-17 of the value. Above, by exp, where what is lost against 1 does not matter. */
#ifndef QO_TANH_H
#define QO_TANH_H

#include <math.h>

static double qo_tanh(double x)
{
    const double square = x * x;
    double size, value;
    if (square < 0.16) {
        return x * (135135.0 + square * (17325.0 + square * (378.0 + square))) /
               (135135.0 + square * (62370.0 + square * (3150.0 + square * 28.0)));
    }
    size = fabs(x);
    value = size > 20.0 ? 1.0 : 1.0 - 2.0 / (exp(2.0 * size) + 1.0);
    return x < 0.0 ? -value : value;
}

#endif
