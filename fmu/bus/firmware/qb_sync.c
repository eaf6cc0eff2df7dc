/* SYNC of a node, both ways, and what happens at one (CiA 301, 7.2.5). */
#include "qb_calls.h"

#define SYNC_PRODUCES 0x40000000u
#define IDENTIFIER 0x1FFFFFFFu
#define MICROSECOND 1000LL
#define SYNC_LENGTH 0x8240

static void restart_sync(qb_network *net, int node)
{
    const qb_sync *sync = &net->nodes[node].sync;
    qb_stop_timer(net, node, QB_T_SYNC);
    if (sync->running && sync->cob_id & SYNC_PRODUCES && sync->period > 0) {
        qb_set_timer(net, node, QB_T_SYNC, sync->period * MICROSECOND);
    }
}

void qb_reset_sync(qb_network *net, int node)
{
    qb_sync *sync = &net->nodes[node].sync;
    sync->cob_id = (uint32_t)qb_value(net, node, 0x1005, 0, 0x080);
    sync->period = (uint32_t)qb_value(net, node, 0x1006, 0, 0);
    sync->overflow = (uint8_t)qb_value(net, node, 0x1019, 0, 0);
    sync->window = qb_value(net, node, 0x1007, 0, 0) * MICROSECOND;
    sync->seen_at = net->now;
    sync->counter = 0;
    sync->misfit = 0;
}

void qb_run_sync(qb_network *net, int node, int running)
{
    qb_sync *sync = &net->nodes[node].sync;
    if (running != sync->running) {
        sync->running = running;
        restart_sync(net, node);
    }
}

void qb_send_sync(qb_network *net, int node)
{
    const qb_sync *sync = &net->nodes[node].sync;
    const uint8_t following = sync->overflow ? (uint8_t)(sync->counter % sync->overflow + 1) : 0;
    qb_set_timer(net, node, QB_T_SYNC, sync->period * MICROSECOND);
    qb_produce_sync(net, node, sync->cob_id & IDENTIFIER, &following, following ? 1 : 0);
}

int qb_accepts_sync(qb_network *net, int node, const qb_frame *frame)
{
    qb_sync *sync = &net->nodes[node].sync;
    sync->misfit = frame->length != (sync->overflow ? 1 : 0);
    if (!sync->misfit) {
        sync->counter = frame->length ? frame->data[0] : 0;
        sync->seen_at = net->now;
        qb_end_communication(net, node, SYNC_LENGTH, QB_ANY_SOURCE);
    } else if (qb_talks(net, node)) {
        qb_report_communication(net, node, SYNC_LENGTH, frame->length);
    }
    return !sync->misfit;
}

qb_abort qb_write_sync(qb_network *net, int node, uint16_t index, uint32_t value)
{
    qb_sync *sync = &net->nodes[node].sync;
    if (index == 0x1005) {
        const int both = sync->cob_id & SYNC_PRODUCES && value & SYNC_PRODUCES;
        const int started = value & SYNC_PRODUCES && !(sync->cob_id & SYNC_PRODUCES);
        if (qb_check_cob_id(value) != QB_FINE || (both && (sync->cob_id ^ value) & IDENTIFIER)) {
            return QB_VALUE_RANGE_EXCEEDED;
        }
        sync->cob_id = value;
        sync->counter = started ? 0 : sync->counter;
        restart_sync(net, node);
    } else if (index == 0x1006) {
        sync->period = value;
        restart_sync(net, node);
    } else if (index == 0x1007) {
        sync->window = value * MICROSECOND;
        sync->seen_at = net->now;
    } else {
        if (sync->period > 0) {
            return QB_DEVICE_STATE;
        }
        if (value == 1 || value > 240) {
            return QB_VALUE_RANGE_EXCEEDED;
        }
        sync->overflow = (uint8_t)value;
        sync->counter = 0;
    }
    return QB_FINE;
}

void qb_latch(qb_network *net, int node)
{
    qb_node *me = &net->nodes[node];
    int k;
    if (me->state != QB_OPERATIONAL) {
        return;
    }
    for (k = 0; k < QB_PDOS; k++) {
        if (me->rpdos[k].wired && me->rpdos[k].type <= 240) {
            qb_rpdo_sync(net, node, k);
        }
    }
    if (qb_is_drive(node)) {
        qb_drive_sample(net, node);
    } else {
        qb_encoder_sample(net, node);
    }
    for (k = 0; k < QB_PDOS; k++) {
        if (me->tpdos[k].wired) {
            qb_tpdo_sample(net, node, k);
        }
    }
}

void qb_notify(qb_network *net, int node)
{
    if (net->nodes[node].state == QB_OPERATIONAL) {
        qb_tpdo_event(net, node);
    }
}
