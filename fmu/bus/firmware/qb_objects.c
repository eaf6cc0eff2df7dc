/* The objects of the device profiles: what reading and writing them does. */
#include <math.h>

#include "qb_calls.h"

#define POSITION_REVERSED 0x80
#define VELOCITY_REVERSED 0x40

static int64_t clamp(double value, int64_t limit)
{
    return value > (double)limit ? limit : value < -(double)limit ? -limit : (int64_t)value;
}

static int64_t torque_of(const qb_network *net, int node)
{
    return clamp(rint(qb_shaft_torque(net, qb_place_of(node)) / QB_PERMILLE), 32767);
}

static int drive_read(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t *value)
{
    const qb_drive *me = &net->nodes[node].drive;
    const qb_setpoints *points = &me->points;
    switch (index) {
    case 0x603F: *value = me->error_code; return 1;
    case 0x6040: *value = points->written_controlword; return 1;
    case 0x6041: *value = me->statusword; return 1;
    case 0x6060:
    case 0x6061: *value = me->mode; return 1;
    case 0x6064: *value = qb_axis_shown_position(net, node); return 1;
    case 0x606B:
        *value = clamp(rint(me->velocity_sign * me->velocity_demand * qb_increments(net, node)), 2147483647);
        return 1;
    case 0x606C:
        *value = clamp(rint(me->velocity_sign * qb_shaft_velocity(net, qb_place_of(node)) * qb_increments(net, node)),
                       2147483647);
        return 1;
    case 0x6071: *value = points->target_torque; return 1;
    case 0x6074: *value = me->torque_demand; return 1;
    case 0x6075: *value = QB_RATED_CURRENT_MA; return 1;
    case 0x6076: *value = QB_RATED_TORQUE_MNM; return 1;
    case 0x6077:
    case 0x6078: *value = torque_of(net, node); return 1;
    case 0x6079: *value = (int64_t)rint(qb_stage_voltage(&net->stages[qb_place_of(node)]) * 1e3); return 1;
    case 0x608F:
        *value = QB_COUNTS;
        return subindex == 1;
    case 0x60B2: *value = points->torque_offset; return 1;
    default: return 0;
    }
}

int qb_profile_read(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t *value)
{
    if (index < 0x6000) {
        return 0;
    }
    return qb_is_drive(node) ? drive_read(net, node, index, subindex, value)
                             : qb_encoder_read(net, node, index, subindex, value);
}

/* Puts a set-point in place; zero where the object is none. */
static int set_point(qb_setpoints *points, uint16_t index, int64_t value)
{
    switch (index) {
    case 0x6071: points->target_torque = (int16_t)value; return 1;
    case 0x60B2: points->torque_offset = (int16_t)value; return 1;
    default: return 0;
    }
}

/* An RPDO puts all its values in place before the drive acts on them. */
int qb_profile_write_by_pdo(qb_network *net, int node, uint16_t index, int64_t value)
{
    qb_setpoints *points = &net->nodes[node].drive.points;
    if (!qb_is_drive(node)) {
        return 0;
    }
    if (index == 0x6040) {
        points->controlword = points->written_controlword = (uint16_t)value;
        return 1;
    }
    return set_point(points, index, value);
}

/* The controlword is processed where bit 9 of the statusword (remote) is set. */
static void write_controlword(qb_network *net, int node, uint16_t value)
{
    qb_setpoints *points = &net->nodes[node].drive.points;
    points->written_controlword = value;
    if (net->nodes[node].state == QB_OPERATIONAL) {
        points->controlword = value;
        qb_drive_applied(net, node);
    }
}

static qb_abort drive_write(qb_network *net, int node, uint16_t index, int64_t value)
{
    if (set_point(&net->nodes[node].drive.points, index, value)) {
        qb_drive_follow(net, node);
        return QB_FINE;
    }
    switch (index) {
    case 0x6040: write_controlword(net, node, (uint16_t)value); return QB_FINE;
    case 0x6060:
        if (value != 0 && value != 10) {
            return QB_VALUE_RANGE_EXCEEDED;
        }
        qb_drive_select(net, node, (int8_t)value);
        return QB_FINE;
    case 0x607E:
        if (value & ~(POSITION_REVERSED | VELOCITY_REVERSED)) {
            return QB_VALUE_RANGE_EXCEEDED;
        }
        return qb_drive_moves(net, node) ? QB_DEVICE_STATE : QB_FINE;
    default: return QB_FINE;
    }
}

qb_abort qb_profile_write(qb_network *net, int node, uint16_t index, int64_t value)
{
    return qb_is_drive(node) ? drive_write(net, node, index, value) : qb_encoder_write(net, node, index, value);
}

/* Something has been stored that the axis keeps in another form. */
void qb_profile_changed(qb_network *net, int node, uint16_t index)
{
    qb_drive *me = &net->nodes[node].drive;
    if (index == 0x607E && qb_is_drive(node)) {
        const int64_t polarity = qb_value(net, node, 0x607E, 0, 0);
        me->position_sign = polarity & POSITION_REVERSED ? -1 : 1;
        me->velocity_sign = polarity & VELOCITY_REVERSED ? -1 : 1;
    }
}
