/* One axis: torque of the bus, velocity loop of the stops, limits, and what is looked after. */
#include <math.h>

#include "qb_calls.h"

#define TICK 0.001 /* period of the drive's own loops [s] */
#define TAU 6.283185307179586
#define VOLTAGE_MARGIN 0.8  /* share of the way from chopper to trip level at which braking has gone to zero */
#define WARNING_LOAD 0.9
#define SPEED_MARGIN 2.0    /* times the highest speed that a count may suggest */
#define SHAFT_MARGIN 0.02   /* revolutions on top of it */
#define STUCK_TIME 0.05     /* for which a count may stay the same under torque [s] */
#define STUCK_TORQUE 1000   /* [per mille] */
#define UNLIMITED HUGE_VAL

enum { SLOW_DOWN = 1, QUICK_STOP = 2, CURRENT_LIMIT = 3, VOLTAGE_LIMIT = 4 };

static qb_drive *drive_of(qb_network *net, int node) { return &net->nodes[node].drive; }
static qb_stage *stage_of(qb_network *net, int node) { return &net->stages[qb_place_of(node)]; }
static double speed_of(const qb_network *net, int node) { return qb_shaft_velocity(net, qb_place_of(node)); }
static double object(qb_network *net, int node, uint16_t index, uint8_t subindex)
{
    return (double)qb_value(net, node, index, subindex, 0);
}
static double of_counts(qb_network *net, int node, uint16_t index)
{
    return object(net, node, index, 0) * (TAU / QB_COUNTS);
}
static double seconds(int64_t time) { return (double)time / 1e9; }
static double max_motor_speed(qb_network *net, int node) { return object(net, node, 0x6080, 0) * (TAU / 60.0); }

double qb_increments(const qb_network *net, int node)
{
    (void)net, (void)node;
    return QB_COUNTS / TAU;
}

int32_t qb_wrap(int64_t count) { return (int32_t)(uint32_t)(uint64_t)count; }

/* Highest torque that 6072h, 6073h and 60E0h (forward) or 60E1h (backward) leave [per mille]. */
static int torque_limit(qb_network *net, int node, uint16_t of_direction)
{
    const int64_t torque = qb_value(net, node, 0x6072, 0, 0), current = qb_value(net, node, 0x6073, 0, 0);
    const int64_t lower = torque < current ? torque : current, other = qb_value(net, node, of_direction, 0, 0);
    return (int)(lower < other ? lower : other);
}

static double approach(double value, double target, double step)
{
    return target > value ? fmin(value + step, target) : fmax(value - step, target);
}

int32_t qb_axis_position(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    me->count = qb_shaft_position(net, qb_place_of(node));
    me->read_at = net->now;
    return me->count;
}

int32_t qb_axis_shown_position(qb_network *net, int node)
{
    return qb_wrap((int64_t)drive_of(net, node)->position_sign * qb_axis_position(net, node));
}

void qb_axis_reset(qb_network *net, int node)
{
    const qb_setpoints none = {0};
    drive_of(net, node)->points = none;
    qb_profile_changed(net, node, 0x607E);
    qb_axis_release(net, node);
}

void qb_axis_release(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    me->torque_demand = 0;
    me->velocity_demand = 0.0;
    qb_axis_position(net, node);
    me->limited = 0;
    me->integral = 0.0;
}

/* A torque less what would drive the motor beyond 6080h, by the gain of the velocity loop. */
static double governed(qb_network *net, int node, double torque)
{
    const double velocity = speed_of(net, node), excess = fabs(velocity) - max_motor_speed(net, node);
    if (excess <= 0.0 || torque * velocity <= 0.0) {
        return torque;
    }
    return copysign(fmax(0.0, fabs(torque) - object(net, node, 0x60F9, 1) * 1e-6 * excess), torque);
}

/* Cyclic synchronous torque: the set-point of the bus goes to the current loop. */
static void follow_torque(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    const int target = me->points.target_torque + me->points.torque_offset;
    const int high = torque_limit(net, node, 0x60E0), low = -torque_limit(net, node, 0x60E1);
    int demand = target > low ? target : low;
    demand = demand < high ? demand : high;
    if (fabs(speed_of(net, node)) > max_motor_speed(net, node)) {
        demand = (int)rint(governed(net, node, demand * QB_PERMILLE) / QB_PERMILLE);
    }
    me->torque_demand = demand;
    me->limited = demand != target;
    qb_stage_command(stage_of(net, node), demand * QB_PERMILLE, 0);
}

static void rest(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    me->torque_demand = 0;
    me->limited = 0;
    qb_stage_command(stage_of(net, node), 0.0, 0);
}

void qb_axis_start(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    if (me->motion == QB_STOP) {
        me->velocity_demand = speed_of(net, node);
        me->integral = me->torque_demand * QB_PERMILLE;
        me->stop_torque = me->torque_demand;
        me->held = 0.0;
        me->done = 0;
    } else {
        qb_axis_take(net, node);
    }
}

/* Set-points may have changed; whether the statusword may have, too. */
int qb_axis_take(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    const int limited = me->limited;
    if (me->motion == QB_CYCLIC_TORQUE) {
        follow_torque(net, node);
    } else if (me->motion == QB_NO_MODE) {
        rest(net, node);
    }
    return me->motion == QB_STOP || me->limited != limited;
}

/* Asks the current loop for a torque [Nm] within the limits; whether they took something away. */
static int command(qb_network *net, int node, double torque, double share)
{
    qb_drive *me = drive_of(net, node);
    const double high = torque_limit(net, node, 0x60E0) * QB_PERMILLE * share;
    const double low = -torque_limit(net, node, 0x60E1) * QB_PERMILLE * share;
    const double allowed = fmin(fmax(governed(net, node, torque), low), high);
    qb_stage_command(stage_of(net, node), allowed, 1);
    me->torque_demand = (int)rint(allowed / QB_PERMILLE);
    me->limited = allowed != torque;
    return me->limited;
}

/* One step of the velocity loop; the integral part stands still while the torque is limited. */
static void control_velocity(qb_network *net, int node, double acceleration, double share)
{
    qb_drive *me = drive_of(net, node);
    const double gain = object(net, node, 0x60F9, 1) * 1e-6, inertia = object(net, node, 0x60F9, 3) * 1e-9;
    const double error = me->velocity_demand - speed_of(net, node);
    const double direct = gain * error + inertia * acceleration + 0.0;
    const double step = gain * error * TICK / (object(net, node, 0x60F9, 2) * 1e-4);
    if (!command(net, node, direct + me->integral + step, share) || step * (direct + me->integral) < 0.0) {
        me->integral += step;
    }
}

static double deceleration(qb_network *net, int node)
{
    const int kind = drive_of(net, node)->stop_kind;
    if (kind == SLOW_DOWN) {
        return fmin(of_counts(net, node, 0x6084), of_counts(net, node, 0x60C6));
    }
    return kind == QUICK_STOP ? of_counts(net, node, 0x6085) : UNLIMITED;
}

/* Share of the torque limit that may be used: braking must not drive the DC link into its protection. */
static double share_of_torque(qb_network *net, int node)
{
    double above;
    if (drive_of(net, node)->stop_kind != VOLTAGE_LIMIT) {
        return 1.0;
    }
    above = (qb_stage_voltage(stage_of(net, node)) - QB_CHOPPER_VOLTAGE) /
            (VOLTAGE_MARGIN * (QB_OVER_VOLTAGE_LEVEL - QB_CHOPPER_VOLTAGE));
    return fmin(fmax(1.0 - above, 0.0), 1.0);
}

static void ramp_velocity(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    const double last = me->velocity_demand, rate = deceleration(net, node);
    int standing;
    me->velocity_demand = approach(last, 0.0, rate * TICK);
    control_velocity(net, node, rate == UNLIMITED ? 0.0 : (me->velocity_demand - last) / TICK,
                     share_of_torque(net, node));
    standing = me->velocity_demand == 0.0 && fabs(speed_of(net, node)) <= of_counts(net, node, 0x606F);
    me->held = standing ? me->held + TICK : 0.0;
    me->done = standing && me->held >= object(net, node, 0x6070, 0) * 1e-3;
}

void qb_axis_tick(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    if (me->by_torque) {
        me->stop_torque = approach(me->stop_torque, 0.0, object(net, node, 0x6087, 0) * TICK);
        command(net, node, me->stop_torque * QB_PERMILLE, 1.0);
        me->done = me->stop_torque == 0.0;
    } else {
        ramp_velocity(net, node);
    }
}

/* Whether a count can be true: one that the shaft cannot have reached, or that stays when it must not, cannot. */
static int accepts(qb_drive *me, double speed)
{
    const int32_t last = me->last_count;
    const int had_last = me->has_last;
    const double elapsed = seconds(me->read_at) - seconds(me->last_time);
    const int gentle = -STUCK_TORQUE < me->torque_demand && me->torque_demand < STUCK_TORQUE;
    me->last_count = me->count;
    me->last_time = me->read_at;
    me->has_last = 1;
    if (!had_last || me->count != last || gentle) {
        me->same_since = me->read_at;
    }
    if (!had_last || me->count == last) {
        return seconds(me->read_at) - seconds(me->same_since) < STUCK_TIME;
    }
    return fabs((double)qb_wrap((int64_t)me->count - last)) <= SHAFT_MARGIN * QB_COUNTS + SPEED_MARGIN * speed * elapsed;
}

int qb_axis_passes(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    int accepted;
    if (me->read_at == me->looked_at) {
        qb_axis_position(net, node); /* nobody has asked for it since the last time */
    }
    me->looked_at = me->read_at;
    accepted = accepts(me, max_motor_speed(net, node) * (QB_COUNTS / TAU));
    if (accepted) {
        me->warns = stage_of(net, node)->thermal_load > WARNING_LOAD;
    }
    return accepted;
}
