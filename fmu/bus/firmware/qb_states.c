/* CiA 402-2: the state machine of a drive, and what it does on every way from state to state. */
#include "qb_states.h"

/* Arrows of the state diagram; 13, from everywhere to a fault, has none. */
static const uint8_t arrows[][2] = {
    [1] = {NOT_READY_TO_SWITCH_ON, SWITCH_ON_DISABLED},  [2] = {SWITCH_ON_DISABLED, READY_TO_SWITCH_ON},
    [3] = {READY_TO_SWITCH_ON, SWITCHED_ON},             [4] = {SWITCHED_ON, OPERATION_ENABLED},
    [5] = {OPERATION_ENABLED, SWITCHED_ON},              [6] = {SWITCHED_ON, READY_TO_SWITCH_ON},
    [7] = {READY_TO_SWITCH_ON, SWITCH_ON_DISABLED},      [8] = {OPERATION_ENABLED, READY_TO_SWITCH_ON},
    [9] = {OPERATION_ENABLED, SWITCH_ON_DISABLED},       [10] = {SWITCHED_ON, SWITCH_ON_DISABLED},
    [11] = {OPERATION_ENABLED, QUICK_STOP_ACTIVE},       [12] = {QUICK_STOP_ACTIVE, SWITCH_ON_DISABLED},
    [13] = {0, FAULT_REACTION_ACTIVE},                   [14] = {FAULT_REACTION_ACTIVE, FAULT},
    [15] = {FAULT, SWITCH_ON_DISABLED},                  [16] = {QUICK_STOP_ACTIVE, OPERATION_ENABLED},
};

/* What a command does in a state. */
static const struct {
    uint8_t state;
    qb_command command;
    uint8_t first, second;
} reactions[] = {
    {SWITCH_ON_DISABLED, SHUTDOWN, 2, 0},         {READY_TO_SWITCH_ON, SWITCH_ON, 3, 0},
    {READY_TO_SWITCH_ON, ENABLE_OPERATION, 3, 4}, {READY_TO_SWITCH_ON, DISABLE_VOLTAGE, 7, 0},
    {READY_TO_SWITCH_ON, QUICK_STOP, 7, 0},       {SWITCHED_ON, ENABLE_OPERATION, 4, 0},
    {SWITCHED_ON, SHUTDOWN, 6, 0},                {SWITCHED_ON, DISABLE_VOLTAGE, 10, 0},
    {SWITCHED_ON, QUICK_STOP, 10, 0},             {OPERATION_ENABLED, SWITCH_ON, 5, 0},
    {OPERATION_ENABLED, SHUTDOWN, 8, 0},          {OPERATION_ENABLED, DISABLE_VOLTAGE, 9, 0},
    {OPERATION_ENABLED, QUICK_STOP, 11, 0},       {QUICK_STOP_ACTIVE, DISABLE_VOLTAGE, 12, 0},
    {QUICK_STOP_ACTIVE, ENABLE_OPERATION, 16, 0}, {FAULT, FAULT_RESET, 15, 0},
};

static qb_drive *drive_of(qb_network *net, int node) { return &net->nodes[node].drive; }
static qb_stage *stage_of(qb_network *net, int node) { return &net->stages[qb_place_of(node)]; }
static int option(qb_network *net, int node, uint16_t index) { return (int)qb_value(net, node, index, 0, 0); }

int qb_drive_operates(const qb_drive *me)
{
    return me->state == OPERATION_ENABLED || me->state == QUICK_STOP_ACTIVE || me->state == FAULT_REACTION_ACTIVE;
}

int qb_drive_is_faulty(const qb_drive *me) { return me->state == FAULT || me->state == FAULT_REACTION_ACTIVE; }

int qb_drive_moves(const qb_network *net, int node) { return qb_drive_operates(&net->nodes[node].drive); }

void qb_drive_update_status(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    const int powered = me->state == SWITCHED_ON || qb_drive_operates(me);
    const int of_mode = me->motion == QB_CYCLIC_TORQUE ? 1 << 12 : me->motion == QB_STOP && me->done ? 1 << 10 : 0;
    const uint16_t last = me->statusword;
    me->statusword = (uint16_t)(me->state | powered << 4 | me->warns << 7 |
                                (net->nodes[node].state == QB_OPERATIONAL) << 9 | me->limited << 11 | of_mode);
    if (me->statusword != last) {
        qb_notify(net, node);
    }
}

void qb_drive_forget_setpoints(qb_drive *me)
{
    qb_setpoints kept = {0};
    kept.controlword = me->points.controlword;
    kept.written_controlword = me->points.written_controlword;
    me->points = kept;
}

void qb_drive_run(qb_network *net, int node, qb_motion motion)
{
    qb_drive *me = drive_of(net, node);
    if (motion == QB_NO_POWER) {
        me->has_last = 0;
    }
    qb_stop_timer(net, node, QB_T_TICK);
    me->motion = motion;
    qb_axis_start(net, node);
    if (motion == QB_STOP) {
        qb_set_timer(net, node, QB_T_TICK, QB_MILLISECOND);
    }
}

void qb_drive_operate(qb_network *net, int node)
{
    qb_drive_run(net, node, drive_of(net, node)->mode == 10 ? QB_CYCLIC_TORQUE : QB_NO_MODE);
}

/* Comes to rest, then takes the transition `then`, or stays. */
static void stop_axis(qb_network *net, int node, int kind, int then)
{
    qb_drive *me = drive_of(net, node);
    me->stop_kind = kind;
    me->by_torque = kind == SLOW_DOWN; /* the slow-down ramp of the torque modes, of which all modes here are */
    me->after_stop = then;
    qb_drive_run(net, node, QB_STOP);
}

uint16_t qb_drive_option_before(int number) { return number == 5 ? 0x605C : number == 8 ? 0x605B : 0; }

/* Whether a transition may be taken now; one that a ramp comes before is taken at the end of the ramp. */
static int is_ready(qb_network *net, int node, int number)
{
    qb_drive *me = drive_of(net, node);
    int kind;
    if (number == 16) {
        return option(net, node, 0x605A) > 4;
    }
    if (number == 15) {
        return stage_of(net, node)->thermal_load < 1.0;
    }
    if (!qb_drive_option_before(number)) {
        return 1;
    }
    kind = option(net, node, qb_drive_option_before(number));
    if (kind != DISABLE && me->after_stop != number) {
        stop_axis(net, node, kind, number);
    }
    return kind == DISABLE;
}

static void request(qb_network *net, int node, int number)
{
    if (number && is_ready(net, node, number)) {
        qb_drive_take(net, node, number);
    }
}

void qb_drive_command(qb_network *net, int node, qb_command given)
{
    const uint8_t state = drive_of(net, node)->state;
    unsigned k;
    for (k = 0; k < sizeof reactions / sizeof reactions[0]; k++) {
        if (reactions[k].state == state && reactions[k].command == given) {
            request(net, node, reactions[k].first);
            request(net, node, reactions[k].second);
            return;
        }
    }
}

static void switch_off(qb_network *net, int node)
{
    drive_of(net, node)->after_stop = 0;
    qb_drive_run(net, node, QB_NO_POWER);
    qb_stage_disable(stage_of(net, node));
    qb_axis_release(net, node);
}

static void start_quick_stop(qb_network *net, int node)
{
    const int code = option(net, node, 0x605A);
    qb_drive_forget_setpoints(drive_of(net, node));
    if (code == 0) {
        qb_drive_take(net, node, 12);
    } else {
        stop_axis(net, node, code > 4 ? code - 4 : code, code > 4 ? 0 : 12);
    }
}

static void react(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    qb_drive_forget_setpoints(me);
    if (me->reaction == DISABLE) {
        qb_drive_take(net, node, 14);
    } else {
        stop_axis(net, node, me->reaction, 14);
    }
}

static void carry_out(qb_network *net, int node, int number)
{
    qb_drive *me = drive_of(net, node);
    switch (number) {
    case 4:
    case 16:
        qb_stage_enable(stage_of(net, node));
        me->after_stop = 0;
        qb_drive_operate(net, node);
        break;
    case 5:
    case 8:
    case 9:
    case 12:
    case 14: switch_off(net, node); break;
    case 11: start_quick_stop(net, node); break;
    case 13: react(net, node); break;
    case 15:
        me->error_code = 0;
        qb_clear_errors(net, node);
        break;
    default: break;
    }
    qb_drive_update_status(net, node);
    qb_notify(net, node);
}

void qb_drive_take(qb_network *net, int node, int number)
{
    qb_drive *me = drive_of(net, node);
    if (number == 13 ? !qb_drive_is_faulty(me) : arrows[number][0] == me->state) {
        me->state = arrows[number][1];
        carry_out(net, node, number);
    }
}
