/* NMT slave, heartbeat both ways, and guarding answers of a node (CiA 301, 7.2.8, 7.3.2). */
#include "qb_calls.h"

#define SYNC_PRODUCES 0x40000000u
#define EXTENDED 0x20000000u
#define INVALID 0x80000000u
#define IDENTIFIER 0x1FFFFFFFu
#define ERROR_CONTROL 0x700u
#define HEARTBEAT_MISSING 0x8130

enum { START = 0x01, STOP = 0x02, ENTER_PRE_OPERATIONAL = 0x80, RESET_NODE = 0x81, RESET_COMMUNICATION = 0x82 };

int qb_talks(const qb_network *net, int node)
{
    const qb_nmt state = net->nodes[node].state;
    return state == QB_PRE_OPERATIONAL || state == QB_OPERATIONAL;
}

/* Identifiers that no configurable object may use (CiA 301, table 40). */
qb_abort qb_check_cob_id(uint32_t value)
{
    static const uint16_t restricted[][2] = {{0x000, 0x000}, {0x001, 0x07F}, {0x101, 0x180}, {0x581, 0x5FF},
                                             {0x601, 0x67F}, {0x6E0, 0x6FF}, {0x701, 0x7FF}};
    const uint32_t id = value & IDENTIFIER;
    unsigned k;
    if (value & EXTENDED || id > 0x7FF) {
        return QB_VALUE_RANGE_EXCEEDED;
    }
    for (k = 0; k < sizeof restricted / sizeof restricted[0]; k++) {
        if (restricted[k][0] <= id && id <= restricted[k][1]) {
            return QB_VALUE_RANGE_EXCEEDED;
        }
    }
    return QB_FINE;
}

/* Heartbeat */

static void beat(qb_network *net, int node, int64_t period)
{
    const uint8_t state = (uint8_t)net->nodes[node].state;
    qb_send(net, node, ERROR_CONTROL + qb_places[node].id, &state, 1);
    qb_set_timer(net, node, QB_T_HEARTBEAT, period * QB_MILLISECOND);
}

static int someone_misses(const qb_node *me)
{
    int k, any = 0;
    for (k = 0; k < 128; k++) {
        any |= me->missing[k];
    }
    return any;
}

/* Nodes that are not missed any more are forgotten; where none is left, that is told. */
static void end_of_missing(qb_network *net, int node, int missed)
{
    if (missed && !someone_misses(&net->nodes[node])) {
        qb_end_communication(net, node, HEARTBEAT_MISSING, QB_ANY_SOURCE);
    }
}

static void configure_consumer(qb_network *net, int node, int changed, uint32_t entry)
{
    qb_node *me = &net->nodes[node];
    const int missed = someone_misses(me);
    uint8_t watched[128] = {0};
    int k;
    for (k = 0; k < QB_CONSUMERS; k++) {
        const uint32_t value = k == changed ? entry : (uint32_t)qb_value(net, node, 0x1016, (uint8_t)(k + 1), 0);
        const int used = value & 0xFFFF && value >> 16 & 0x7F;
        qb_stop_timer(net, node, QB_T_CONSUMER + k);
        me->watched[k].node = used ? value >> 16 & 0x7F : 0;
        me->watched[k].period = (int64_t)(value & 0xFFFF) * QB_MILLISECOND;
        watched[me->watched[k].node] = 1;
    }
    for (k = 0; k < 128; k++) {
        me->missing[k] &= k > 0 && watched[k];
    }
    end_of_missing(net, node, missed);
}

static qb_abort write_consumer(qb_network *net, int node, uint8_t subindex, uint32_t value)
{
    const qb_node *me = &net->nodes[node];
    const uint32_t id = value >> 16 & 0xFF;
    int k;
    if (id > 127) {
        return QB_PARAMETER_INCOMPATIBLE;
    }
    for (k = 0; k < QB_CONSUMERS; k++) {
        if (k != subindex - 1 && id && value & 0xFFFF && me->watched[k].node == id) {
            return QB_PARAMETER_INCOMPATIBLE;
        }
    }
    configure_consumer(net, node, subindex - 1, value);
    return QB_FINE;
}

int qb_consumes(const qb_network *net, int node, uint32_t id)
{
    int k, found = 0;
    for (k = 0; k < QB_CONSUMERS; k++) {
        found |= net->nodes[node].watched[k].node != 0 && ERROR_CONTROL + net->nodes[node].watched[k].node == id;
    }
    return found;
}

void qb_heartbeat_receive(qb_network *net, int node, uint32_t id)
{
    qb_node *me = &net->nodes[node];
    int k;
    for (k = 0; k < QB_CONSUMERS; k++) {
        qb_watched *watched = &me->watched[k];
        if (watched->node != 0 && ERROR_CONTROL + watched->node == id) {
            watched->deadline = net->now + watched->period;
            if (!qb_timer_runs(net, node, QB_T_CONSUMER + k)) {
                qb_set_timer(net, node, QB_T_CONSUMER + k, watched->period);
            }
            if (someone_misses(me)) {
                me->missing[watched->node] = 0;
                end_of_missing(net, node, 1);
            }
        }
    }
}

static void enter(qb_network *net, int node, qb_nmt state);

/* What 1029h:1 says of a lost connection (CiA 301, 7.5.2.32). */
static void lose_connection(qb_network *net, int node)
{
    const int64_t behaviour = qb_value(net, node, 0x1029, 1, 0);
    if (qb_is_drive(node)) {
        qb_drive_connection_lost(net, node);
    }
    if (behaviour != 1 && net->nodes[node].state == QB_OPERATIONAL) {
        enter(net, node, behaviour == 2 ? QB_STOPPED : QB_PRE_OPERATIONAL);
    }
}

static void watch(qb_network *net, int node, int number)
{
    qb_watched *watched = &net->nodes[node].watched[number];
    if (watched->deadline > net->now) {
        qb_set_timer(net, node, QB_T_CONSUMER + number, watched->deadline - net->now);
        return;
    }
    net->nodes[node].missing[watched->node] = 1;
    qb_report_communication(net, node, HEARTBEAT_MISSING, watched->node);
    lose_connection(net, node);
}

void qb_guarding_answer(qb_network *net, int node)
{
    qb_node *me = &net->nodes[node];
    const uint8_t value = (uint8_t)(me->state | me->guarding_toggle);
    if (qb_value(net, node, 0x1017, 0, 0) == 0) {
        qb_send(net, node, ERROR_CONTROL + qb_places[node].id, &value, 1);
        me->guarding_toggle ^= 0x80;
    }
}

/* NMT */

static void enter(qb_network *net, int node, qb_nmt state)
{
    qb_node *me = &net->nodes[node];
    if (state == me->state) {
        return;
    }
    me->state = state;
    /* The application first: a TPDO that starts with the new state shows what the state made of it. */
    if (qb_is_drive(node)) {
        qb_drive_nmt_changed(net, node);
    }
    qb_pdo_wire(net, node, 1);
    qb_run_sync(net, node, qb_talks(net, node));
    if (!qb_talks(net, node)) {
        qb_sdo_reset(net, node);
    }
}

static void reset_services(qb_network *net, int node, int application)
{
    const int64_t period = (qb_restore(net, node, application ? 0xFFFF : 0x1FFF), qb_value(net, node, 0x1017, 0, 0));
    int k;
    qb_sdo_reset(net, node);
    qb_emergency_reset(net, node, application);
    qb_pdo_load(net, node);
    qb_reset_sync(net, node);
    qb_stop_timer(net, node, QB_T_HEARTBEAT);
    if (period > 0) {
        qb_set_timer(net, node, QB_T_HEARTBEAT, period * QB_MILLISECOND);
    }
    for (k = 0; k < 128; k++) {
        net->nodes[node].missing[k] = 0;
    }
    configure_consumer(net, node, -1, 0);
    net->nodes[node].guarding_toggle = 0;
    if (application && qb_is_drive(node)) {
        qb_drive_reset(net, node);
    } else if (application) {
        qb_encoder_reset(net, node);
    }
}

void qb_nmt_reset(qb_network *net, int node, int application)
{
    const uint8_t boot_up = 0;
    enter(net, node, QB_INITIALISATION);
    reset_services(net, node, application);
    qb_send(net, node, ERROR_CONTROL + qb_places[node].id, &boot_up, 1);
    enter(net, node, QB_PRE_OPERATIONAL);
}

void qb_nmt_receive(qb_network *net, int node, const qb_frame *frame)
{
    if (frame->length != 2 || (frame->data[1] != 0 && frame->data[1] != qb_places[node].id)) {
        return;
    }
    switch (frame->data[0]) {
    case START: enter(net, node, QB_OPERATIONAL); break;
    case STOP: enter(net, node, QB_STOPPED); break;
    case ENTER_PRE_OPERATIONAL: enter(net, node, QB_PRE_OPERATIONAL); break;
    case RESET_NODE: qb_nmt_reset(net, node, 1); break;
    case RESET_COMMUNICATION: qb_nmt_reset(net, node, 0); break;
    default: break;
    }
}

qb_abort qb_node_write(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t value)
{
    switch (index) {
    case 0x1003:
        if (value != 0) {
            return QB_VALUE_RANGE_EXCEEDED;
        }
        net->nodes[node].emergency.known = 0;
        return QB_FINE;
    case 0x1005:
    case 0x1006:
    case 0x1007:
    case 0x1019: return qb_write_sync(net, node, index, (uint32_t)value);
    case 0x1014: {
        const uint32_t present = qb_emergency_cob_id(net, node);
        const int goes_on = !(present & INVALID) && !((uint32_t)value & INVALID);
        const int refused = value & SYNC_PRODUCES || qb_check_cob_id((uint32_t)value) != QB_FINE ||
                            (goes_on && ((present ^ (uint32_t)value) & IDENTIFIER));
        return refused ? QB_VALUE_RANGE_EXCEEDED : QB_FINE;
    }
    case 0x1016: return write_consumer(net, node, subindex, (uint32_t)value);
    case 0x1017:
        qb_stop_timer(net, node, QB_T_HEARTBEAT);
        if (value > 0) {
            beat(net, node, value);
        }
        return QB_FINE;
    default: return QB_FINE;
    }
}

void qb_node_timer(qb_network *net, int node, int timer)
{
    if (timer == QB_T_HEARTBEAT) {
        beat(net, node, qb_value(net, node, 0x1017, 0, 0));
    } else if (timer == QB_T_SYNC) {
        qb_send_sync(net, node);
    } else {
        watch(net, node, timer - QB_T_CONSUMER);
    }
}
