/* CiA 402-2: the state machine of a drive, its faults, and what option codes make of them. */
#include "qb.h"

enum {
    NOT_READY_TO_SWITCH_ON = 0x00,
    SWITCH_ON_DISABLED = 0x40,
    READY_TO_SWITCH_ON = 0x21,
    SWITCHED_ON = 0x23,
    OPERATION_ENABLED = 0x27,
    QUICK_STOP_ACTIVE = 0x07,
    FAULT_REACTION_ACTIVE = 0x0F,
    FAULT = 0x08
};

typedef enum { NO_COMMAND, SHUTDOWN, SWITCH_ON, ENABLE_OPERATION, DISABLE_VOLTAGE, QUICK_STOP, FAULT_RESET } command;

/* Ways of stopping: values of 605Eh, of 605Ah up to 4. */
enum { DISABLE, SLOW_DOWN };

enum { OPTION_FAULT = 1, OPTION_DISABLE_VOLTAGE = 2, OPTION_QUICK_STOP = 3 };

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
    command command;
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

static void take(qb_network *net, int node, int number);

static qb_drive *drive_of(qb_network *net, int node) { return &net->nodes[node].drive; }
static qb_stage *stage_of(qb_network *net, int node) { return &net->stages[qb_place_of(node)]; }
static int option(qb_network *net, int node, uint16_t index) { return (int)qb_value(net, node, index, 0, 0); }

static int operates(const qb_drive *me)
{
    return me->state == OPERATION_ENABLED || me->state == QUICK_STOP_ACTIVE || me->state == FAULT_REACTION_ACTIVE;
}

static int is_faulty(const qb_drive *me) { return me->state == FAULT || me->state == FAULT_REACTION_ACTIVE; }

int qb_drive_moves(const qb_network *net, int node) { return operates(&net->nodes[node].drive); }

static void update_status(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    const int powered = me->state == SWITCHED_ON || operates(me);
    const int of_mode = me->motion == QB_CYCLIC_TORQUE ? 1 << 12 : me->motion == QB_STOP && me->done ? 1 << 10 : 0;
    const uint16_t last = me->statusword;
    me->statusword = (uint16_t)(me->state | powered << 4 | me->warns << 7 |
                                (net->nodes[node].state == QB_OPERATIONAL) << 9 | me->limited << 11 | of_mode);
    if (me->statusword != last) {
        qb_notify(net, node);
    }
}

static void forget_setpoints(qb_drive *me)
{
    qb_setpoints kept = {0};
    kept.controlword = me->points.controlword;
    kept.written_controlword = me->points.written_controlword;
    me->points = kept;
}

static void run(qb_network *net, int node, qb_motion motion)
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

static void operate(qb_network *net, int node)
{
    run(net, node, drive_of(net, node)->mode == 10 ? QB_CYCLIC_TORQUE : QB_NO_MODE);
}

/* Comes to rest, then takes the transition `then`, or stays. */
static void stop_axis(qb_network *net, int node, int kind, int then)
{
    qb_drive *me = drive_of(net, node);
    me->stop_kind = kind;
    me->by_torque = kind == SLOW_DOWN; /* the slow-down ramp of the torque modes, of which all modes here are */
    me->after_stop = then;
    run(net, node, QB_STOP);
}

/* Option codes of the transitions that a ramp may come before. */
static uint16_t option_before(int number) { return number == 5 ? 0x605C : number == 8 ? 0x605B : 0; }

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
    if (!option_before(number)) {
        return 1;
    }
    kind = option(net, node, option_before(number));
    if (kind != DISABLE && me->after_stop != number) {
        stop_axis(net, node, kind, number);
    }
    return kind == DISABLE;
}

static void request(qb_network *net, int node, int number)
{
    if (number && is_ready(net, node, number)) {
        take(net, node, number);
    }
}

static void carry_command(qb_network *net, int node, command given)
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
    run(net, node, QB_NO_POWER);
    qb_stage_disable(stage_of(net, node));
    qb_axis_release(net, node);
}

static void start_quick_stop(qb_network *net, int node)
{
    const int code = option(net, node, 0x605A);
    forget_setpoints(drive_of(net, node));
    if (code == 0) {
        take(net, node, 12);
    } else {
        stop_axis(net, node, code > 4 ? code - 4 : code, code > 4 ? 0 : 12);
    }
}

static void react(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    forget_setpoints(me);
    if (me->reaction == DISABLE) {
        take(net, node, 14);
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
        operate(net, node);
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
    update_status(net, node);
    qb_notify(net, node);
}

static void take(qb_network *net, int node, int number)
{
    qb_drive *me = drive_of(net, node);
    if (number == 13 ? !is_faulty(me) : arrows[number][0] == me->state) {
        me->state = arrows[number][1];
        carry_out(net, node, number);
    }
}

static void fail(qb_network *net, int node, const fault *what)
{
    qb_drive *me = drive_of(net, node);
    me->error_code = what->code;
    qb_report(net, node, what->code, what->bits);
    if (is_faulty(me)) {
        if (what->fatal) {
            take(net, node, 14);
        }
        return;
    }
    me->reaction = what->fatal || !operates(me) ? DISABLE : option(net, node, 0x605E);
    take(net, node, 13);
}

static void abort_connection(qb_network *net, int node, const fault *what)
{
    qb_drive *me = drive_of(net, node);
    switch (option(net, node, 0x6007)) {
    case OPTION_FAULT:
        if (!is_faulty(me)) {
            fail(net, node, what);
        }
        break;
    case OPTION_DISABLE_VOLTAGE:
        forget_setpoints(me);
        carry_command(net, node, DISABLE_VOLTAGE);
        break;
    case OPTION_QUICK_STOP: carry_command(net, node, QUICK_STOP); break;
    default: break;
    }
}

void qb_drive_reset(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    run(net, node, QB_NO_POWER);
    qb_stage_disable(stage_of(net, node));
    qb_axis_reset(net, node);
    me->mode = 0;
    me->error_code = 0;
    me->after_stop = 0;
    me->state = NOT_READY_TO_SWITCH_ON;
    me->reset_level = 0;
    take(net, node, 1);
    update_status(net, node);
}

void qb_drive_nmt_changed(qb_network *net, int node)
{
    if (net->nodes[node].state != QB_OPERATIONAL && operates(drive_of(net, node))) {
        abort_connection(net, node, &not_operational);
    }
    update_status(net, node);
}

static command decode(uint8_t word)
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
            carry_command(net, node, FAULT_RESET);
            return;
        }
    }
    carry_command(net, node, decode((uint8_t)controlword));
}

void qb_drive_applied(qb_network *net, int node)
{
    qb_drive *me = drive_of(net, node);
    const uint16_t controlword = me->points.controlword;
    control(net, node, controlword);
    if (option_before(me->after_stop) && (controlword & 0x8F) == 0x0F) {
        me->after_stop = 0;
        operate(net, node);
        update_status(net, node);
    }
    qb_drive_follow(net, node);
}

void qb_drive_follow(qb_network *net, int node)
{
    if (qb_axis_take(net, node)) {
        update_status(net, node);
    }
}

void qb_drive_setpoints_missing(qb_network *net, int node)
{
    if (operates(drive_of(net, node))) {
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
            operate(net, node);
        }
        update_status(net, node);
    }
}

static void supervise(qb_network *net, int node)
{
    const int warned = drive_of(net, node)->warns;
    if (!qb_axis_passes(net, node)) {
        fail(net, node, &of_trip[QB_ENCODER_TRIP]);
    } else if (drive_of(net, node)->warns != warned) {
        update_status(net, node);
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
        take(net, node, me->after_stop);
    }
    update_status(net, node);
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
