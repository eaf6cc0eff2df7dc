/* Receive PDOs: applied at once or with the next SYNC, watched for length and for missing (CiA 301, 7.2.2). */
#include <string.h>

#include "qb_calls.h"

#define SYNCHRONOUS_MAX 240
#define TOO_SHORT 0x8210
#define TOO_LONG 0x8220
#define TIMEOUT 0x8250

void qb_rpdo_compile(qb_pdo *pdo) { pdo->waiting = 0; }

static int is_dummy(uint32_t entry) { return entry >> 16 >= 2 && entry >> 16 <= 7; }

static void apply(qb_network *net, int node, qb_pdo *pdo, const uint8_t *data)
{
    const uint8_t *place = data;
    qb_abort missing;
    int k;
    for (k = 0; k < pdo->count; k++) {
        if (!is_dummy(pdo->entries[k])) {
            const int row = qb_find(node, (uint16_t)(pdo->entries[k] >> 16), (uint8_t)(pdo->entries[k] >> 8), &missing);
            if (row >= 0) {
                qb_write_by_pdo(net, node, row, qb_unpack(place, pdo->sizes[k], qb_row(node, row)->flags & QB_SIGNED));
            }
        }
        place += pdo->sizes[k];
    }
    /* Only when the whole PDO is in place does the device act on it: a controlword on the new target. */
    if (qb_is_drive(node)) {
        qb_drive_applied(net, node);
    }
}

static void meet_deadline(qb_network *net, int node, int number, qb_pdo *pdo)
{
    pdo->deadline = net->now + pdo->period;
    if (!qb_timer_runs(net, node, QB_T_RPDO + number)) {
        qb_set_timer(net, node, QB_T_RPDO + number, pdo->period);
    }
    if (pdo->missing) {
        pdo->missing = 0;
        qb_end_communication(net, node, TIMEOUT, number + 1);
    }
}

void qb_rpdo_receive(qb_network *net, int node, int number, const qb_frame *frame)
{
    qb_pdo *pdo = &net->nodes[node].rpdos[number];
    const qb_sync *sync = &net->nodes[node].sync;
    if (frame->length != pdo->length) {
        pdo->misfit = 1;
        qb_report_communication(net, node, frame->length > pdo->length ? TOO_LONG : TOO_SHORT, (uint16_t)(number + 1));
        if (frame->length < pdo->length) {
            return;
        }
    } else if (pdo->misfit) {
        pdo->misfit = 0;
        qb_end_communication(net, node, TOO_LONG, number + 1);
        qb_end_communication(net, node, TOO_SHORT, number + 1);
    }
    if (pdo->period > 0) {
        meet_deadline(net, node, number, pdo);
    }
    if (pdo->type > SYNCHRONOUS_MAX) {
        apply(net, node, pdo, frame->data);
    } else if (!(sync->window > 0 && net->now - sync->seen_at > sync->window)) {
        pdo->waiting = 1;
        memcpy(pdo->received, frame->data, sizeof pdo->received);
    }
}

void qb_rpdo_sync(qb_network *net, int node, int number)
{
    qb_pdo *pdo = &net->nodes[node].rpdos[number];
    uint8_t data[8];
    if (pdo->waiting) {
        pdo->waiting = 0;
        memcpy(data, pdo->received, sizeof data);
        apply(net, node, pdo, data);
    }
}

void qb_rpdo_timer(qb_network *net, int node, int number)
{
    qb_pdo *pdo = &net->nodes[node].rpdos[number];
    if (pdo->deadline > net->now) {
        qb_set_timer(net, node, QB_T_RPDO + number, pdo->deadline - net->now);
        return;
    }
    pdo->missing = 1;
    qb_report_communication(net, node, TIMEOUT, (uint16_t)(number + 1));
    if (qb_is_drive(node)) {
        qb_drive_setpoints_missing(net, node);
    }
}
