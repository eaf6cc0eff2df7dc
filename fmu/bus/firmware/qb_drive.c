/* CiA 402-2: what happens to a drive: controlwords, set-points, faults, and what option codes make of them. */
#include "qb_states.h"

enum { OPTION_FAULT = 1, OPTION_DISABLE_VOLTAGE = 2, OPTION_QUICK_STOP = 3 };

/* Error code, bits of 1001h, and whether the power goes off whatever 605Eh says. */
typedef struct {
    uint16_t code;
    uint8_t bits;
    int fatal;
} fault;

static const fault heartbeat_lost = {0x8130, 0x10, 0}, not_operational = {0x8100, 0x10, 0};
static const fault setpoints_missing = {0x8250, 0x10, 0};
static const fault of_trip[] = {
    [QB_OVER_CURRENT] = {0x2310, 0x02, 1}, [QB_OVER_TEMPERATURE] = {0x4310, 0x08, 0},
    [QB_OVER_VOLTAGE] = {0x3210, 0x04, 1}, [QB_BLOCKED] = {0x7121, 0x20, 1},
    [QB_ENCODER_TRIP] = {0x7305, 0x20, 1},
};

static qb_drive *drive_of(qb_network *net, int node) { return &net->nodes[node].drive; }
static qb_stage *stage_of(qb_network *net, int node) { return &net->stages[qb_place_of(node)]; }
static int option(qb_network *net, int node, uint16_t index) { return (int)qb_value(net, node, index, 0, 0); }

static void fail(qb_network *net, int node, const fault *what)
{
    qb_drive *me = drive_of(net, node);
    me->error_code = what->code;
    qb_report(net, node, what->code, what->bits);
    if (qb_drive_is_faulty(me)) {
        if (what->fatal) {
            qb_drive_take(net, node, 14);
        }
        return;
    }
    me->reaction = what->fatal || !qb_drive_operates(me) ? DISABLE : option(net, node, 0x605E);
    qb_drive_take(net, node, 13);
}

static void abort_connection(qb_network *net, int node, const fault *what)
{
    qb_drive *me = drive_of(net, node);
    switch (option(net, node, 0x6007)) {
    case OPTION_FAULT:
        if (!qb_drive_is_faulty(me)) {
            fail(net, node, what);
        }
        break;
    case OPTION_DISABLE_VOLTAGE:
        qb_drive_forget_setpoints(me);
        qb_drive_command(net, node, DISABLE_VOLTAGE);
        break;
    case OPTION_QUICK_STOP: qb_drive_command(net, node, QUICK_STOP); break;
    default: break;
    }
}

void qb_drive_reset(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    qb_drive_run(net, node, QB_NO_POWER);
    qb_stage_disable(stage_of(net, node));
    qb_axis_reset(net, node);
    me->mode = 0;
    me->error_code = 0;
    me->after_stop = 0;
    me->state = NOT_READY_TO_SWITCH_ON;
    me->reset_level = 0;
    qb_drive_take(net, node, 1);
    qb_drive_update_status(net, node);
}

void qb_drive_nmt_changed(qb_network *net, int node)
{
    if (net->nodes[node].state != QB_OPERATIONAL && qb_drive_operates(drive_of(net, node))) {
        abort_connection(net, node, &not_operational);
    }
    qb_drive_update_status(net, node);
}

static qb_command decode(uint8_t word)
{
    if ((word & 0x82) == 0x00) {
        return DISABLE_VOLTAGE;
    }
    if ((word & 0x86) == 0x02) {
        return QUICK_STOP;
    }
    if ((word & 0x87) == 0x06) {
        return SHUTDOWN;
    }
    if ((word & 0x8F) == 0x07) {
        return SWITCH_ON;
    }
    return (word & 0x8F) == 0x0F ? ENABLE_OPERATION : NO_COMMAND;
}

/* A fault reset is the rising edge of bit 7. */
static void control(qb_network *net, int node, uint16_t controlword)
{
    qb_drive *me = drive_of(net, node);
    const int level = (controlword & 0x80) != 0;
    if (level != me->reset_level) {
        me->reset_level = (uint8_t)level;
        if (level) {
            qb_drive_command(net, node, FAULT_RESET);
            return;
        }
    }
    qb_drive_command(net, node, decode((uint8_t)controlword));
}

void qb_drive_applied(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    const uint16_t controlword = me->points.controlword;
    control(net, node, controlword);
    if (qb_drive_option_before(me->after_stop) && (controlword & 0x8F) == 0x0F) {
        me->after_stop = 0;
        qb_drive_operate(net, node);
        qb_drive_update_status(net, node);
    }
    qb_drive_follow(net, node);
}

void qb_drive_follow(qb_network *net, int node)
{
    if (qb_axis_take(net, node)) {
        qb_drive_update_status(net, node);
    }
}

void qb_drive_setpoints_missing(qb_network *net, int node)
{
    if (qb_drive_operates(drive_of(net, node))) {
        fail(net, node, &setpoints_missing);
    }
}

void qb_drive_connection_lost(qb_network *net, int node) { abort_connection(net, node, &heartbeat_lost); }

void qb_drive_select(qb_network *net, int node, int8_t mode)
{
    qb_drive *me = drive_of(net, node);
    if (mode != me->mode) {
        me->mode = mode;
        if (me->state == OPERATION_ENABLED && !me->after_stop) {
            qb_drive_operate(net, node);
        }
        qb_drive_update_status(net, node);
    }
}

static void supervise(qb_network *net, int node)
{
    const int warned = drive_of(net, node)->warns;
    if (!qb_axis_passes(net, node)) {
        fail(net, node, &of_trip[QB_ENCODER_TRIP]);
    } else if (drive_of(net, node)->warns != warned) {
        qb_drive_update_status(net, node);
    }
}

void qb_drive_sample(qb_network *net, int node)
{
    const qb_motion motion = drive_of(net, node)->motion;
    if (motion == QB_NO_MODE || motion == QB_CYCLIC_TORQUE) {
        supervise(net, node);
    }
}

void qb_drive_tick(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    if (me->motion != QB_STOP) {
        return;
    }
    qb_set_timer(net, node, QB_T_TICK, QB_MILLISECOND);
    supervise(net, node);
    if (me->motion != QB_STOP) {
        return;
    }
    qb_axis_tick(net, node);
    if (me->done && me->after_stop) {
        qb_drive_take(net, node, me->after_stop);
    }
    qb_drive_update_status(net, node);
}

void qb_drive_tripped(qb_network *net, int place, int trip)
{
    int node;
    for (node = 0; node < QB_NODES; node++) {
        if (qb_is_drive(node) && qb_place_of(node) == place) {
            fail(net, node, &of_trip[trip]);
        }
    }
}
