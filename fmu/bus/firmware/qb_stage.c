/* Hardware of the drives: current loop, DC link with brake chopper, protection, motor encoder. */
#include <math.h>

#include "qb_calls.h"

#define STALL_SPEED 1.0 /* of the shaft, below which it counts as standing [rad/s] */
#define THERMAL_LIMIT 1.05
#define STEP 0.001 /* [s] */

static void clear(qb_stage *me)
{
    me->trip = 0;
    me->at_peak = me->stalled = 0.0;
}

void qb_stage_start(qb_network *net)
{
    int place;
    for (place = 0; place < QB_DRIVES; place++) {
        net->stages[place].energy = QB_SUPPLY_ENERGY;
    }
}

void qb_stage_enable(qb_stage *me)
{
    clear(me);
    me->enabled = 1;
}

void qb_stage_disable(qb_stage *me)
{
    me->enabled = me->steps_left = 0;
    me->target = me->setpoint = me->torque = me->wheel_torque = 0.0;
}

void qb_stage_command(qb_stage *me, double torque, int at_once)
{
    if (me->enabled) {
        me->target = fmin(fmax(torque, -QB_PEAK_TORQUE), QB_PEAK_TORQUE);
        me->steps_left = at_once ? 1 : QB_RAMP_STEPS;
    }
}

double qb_stage_voltage(const qb_stage *me) { return sqrt(2.0 * me->energy / QB_CAPACITANCE); }

double qb_shaft_velocity(const qb_network *net, int place)
{
    return qb_mountings[place].shaft_ratio * net->wheel_rate[place];
}

double qb_shaft_torque(const qb_network *net, int place)
{
    return net->stages[place].torque + net->torque_noise[place];
}

int32_t qb_shaft_position(const qb_network *net, int place)
{
    const double exact = qb_mountings[place].increments * net->wheel_angle[place];
    return qb_wrap((int64_t)rint(exact + net->motor_dither[place]));
}

static int overload(qb_stage *me, double torque, double speed)
{
    me->at_peak = torque >= QB_PEAK_LEVEL ? me->at_peak + STEP : 0.0;
    me->stalled = speed < STALL_SPEED ? me->stalled + STEP : 0.0;
    if (me->at_peak > QB_PEAK_TIME) {
        return QB_OVER_CURRENT;
    }
    if (me->stalled > QB_STALL_TIME) {
        return QB_BLOCKED;
    }
    return me->thermal_load > THERMAL_LIMIT ? QB_OVER_TEMPERATURE : 0;
}

/* DC link and protection over one step under a torque at a speed of the shaft; what responds, or zero. */
static int protect(qb_stage *me, double torque, double speed)
{
    const double squared = torque * torque;
    const double load = squared / (QB_RATED_TORQUE * QB_RATED_TORQUE);
    const double energy = me->energy - STEP * (torque * speed + QB_COPPER * squared);
    me->thermal_load += QB_HEATING * (load - me->thermal_load);
    if (energy <= QB_SUPPLY_ENERGY) {
        me->energy = QB_SUPPLY_ENERGY;
    } else {
        const double excess = energy - QB_CHOPPER_ENERGY;
        me->energy = excess > 0.0 ? energy - fmin(excess, QB_CHOPPED) : energy;
    }
    if (load <= 1.0) {
        me->at_peak = me->stalled = 0.0;
    } else if (me->energy <= QB_TRIP_ENERGY) {
        return overload(me, fabs(torque), fabs(speed));
    }
    return me->energy > QB_TRIP_ENERGY ? QB_OVER_VOLTAGE : 0;
}

void qb_stage_advance(qb_network *net, int place)
{
    qb_stage *me = &net->stages[place];
    const double start = me->setpoint;
    int trip;
    if (!me->enabled) {
        me->thermal_load -= QB_HEATING * me->thermal_load;
        return;
    }
    if (me->steps_left > 0) {
        me->setpoint = start + (me->target - start) / me->steps_left;
        me->steps_left--;
    }
    me->torque = QB_KEEP * me->torque + QB_FROM_START * start + QB_FROM_END * me->setpoint;
    me->wheel_torque = qb_mountings[place].shaft_ratio * me->torque;
    trip = protect(me, me->torque, qb_shaft_velocity(net, place));
    /* After an over-temperature the motor still brakes: what happens on the way is responded to as well. */
    if (trip && (!me->trip || (me->trip == QB_OVER_TEMPERATURE && trip != me->trip))) {
        me->trip = trip;
        qb_drive_tripped(net, place, trip);
    }
}
