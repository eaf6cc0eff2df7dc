/* The plant under the devices: it follows their time in steps of a millisecond. */
#include <math.h>
#include <string.h>

#include "bus.h"

#define STEP 1e-3
#define TAU 6.283185307179586

static double value_of(const qo_instance *plant, unsigned reference)
{
    const qo_variable *variable = &qo_variables[reference];
    switch (variable->role) {
    case QO_STATE: return plant->now.model.x[variable->index];
    case QO_INPUT: return plant->now.model.u[variable->index];
    default: return plant->now.model.y[variable->index];
    }
}

static void sense(qb_bus *me)
{
    qb_network *net = &me->now.net;
    int k;
    for (k = 0; k < QB_DRIVES; k++) {
        net->wheel_angle[k] = value_of(&me->plant, qb_wheel_angles[k]);
        net->wheel_rate[k] = value_of(&me->plant, qb_wheel_rates[k]);
    }
    for (k = 0; k < QB_STEERINGS; k++) {
        net->steering_angle[k] = value_of(&me->plant, qb_steering_angles[k]);
    }
}

static double uniform(qb_noise *noise)
{
    noise->state ^= noise->state << 13;
    noise->state ^= noise->state >> 7;
    noise->state ^= noise->state << 17;
    return ((double)(noise->state >> 11) + 0.5) / 9007199254740992.0;
}

/* A normal number, by Box and Muller. */
static double normal(qb_noise *noise)
{
    const double radius = sqrt(-2.0 * log(uniform(noise)));
    return radius * cos(TAU * uniform(noise));
}

static void disturb(qb_bus *me)
{
    qb_network *net = &me->now.net;
    qb_noise *noise = &me->now.noise;
    int k;
    for (k = 0; k < QB_DRIVES; k++) {
        net->torque_noise[k] = noise->torque > 0.0 ? noise->torque * QB_RATED_TORQUE * normal(noise) : 0.0;
        net->motor_dither[k] = noise->encoder > 0.0 ? noise->encoder * normal(noise) : 0.0;
    }
    for (k = 0; k < QB_STEERINGS; k++) {
        net->steering_dither[k] = noise->encoder > 0.0 ? noise->encoder * normal(noise) : 0.0;
    }
}

void qb_plant_reset(qb_bus *me)
{
    memset(&me->now, 0, sizeof me->now);
    me->now.noise.torque = QB_NOISE_TORQUE;
    me->now.noise.encoder = QB_NOISE_ENCODER;
    me->now.noise.seed = 1;
    me->now.announced = QB_NEVER;
}

void qb_plant_start(qb_bus *me)
{
    /* Seeds that differ by one bit are far apart; none gives zero, where the generator would stay. */
    me->now.noise.state = ((uint64_t)(uint32_t)me->now.noise.seed + 1) * 0x9E3779B97F4A7C15u;
    me->now.start_time = me->plant.now.time;
    sense(me);
    qb_start(&me->now.net);
    sense(me);
    disturb(me);
}

/* Torque moves within the step; the plant gets its mean, so that it does not lag behind what the drives report. */
static qo_status step(qb_bus *me)
{
    qb_network *net = &me->now.net;
    qo_model *model = &me->plant.now.model;
    double before[QB_DRIVES];
    qo_status status;
    int k;
    for (k = 0; k < QB_DRIVES; k++) {
        before[k] = net->stages[k].wheel_torque;
    }
    for (k = 0; k < QB_DRIVES; k++) {
        qb_stage_advance(net, k);
    }
    for (k = 0; k < QB_DRIVES; k++) {
        model->u[qo_variables[qb_torques[k]].index] = (before[k] + net->stages[k].wheel_torque) / 2 / QB_GEAR_RATIO;
    }
    status = qo_step(model, STEP);
    sense(me);
    disturb(me);
    return status;
}

int qb_plant_move(void *bus, qb_network *net)
{
    qb_bus *me = bus;
    while (net->now - net->moved >= QB_MILLISECOND) {
        const qo_status status = step(me);
        if (status != QO_OK) {
            qo_pass(&me->plant, status);
            return 0;
        }
        net->moved += QB_MILLISECOND;
    }
    me->plant.now.known = 0;
    return 1;
}

int qb_is_driven(unsigned reference)
{
    int k, any = 0;
    for (k = 0; k < QB_DRIVES; k++) {
        any |= qb_torques[k] == reference;
    }
    return any;
}
