/* Transmit PDOs: with every n-th SYNC, with the SYNC after an event, on the event, or on request (CiA 301, 7.2.2). */
#include <string.h>

#include "qb_calls.h"

#define LOOKS_EVERY QB_MILLISECOND /* mapped values are compared with those sent last */

enum { SAMPLED_FOR_REMOTE = 252, EVENT_DRIVEN = 254 };

static qb_pdo *tpdo_of(qb_network *net, int node, int number) { return &net->nodes[node].tpdos[number]; }

void qb_tpdo_data(qb_network *net, int node, int number, uint8_t *data)
{
    const qb_pdo *pdo = tpdo_of(net, node, number);
    qb_abort missing;
    int k;
    memset(data, 0, 8);
    for (k = 0; k < pdo->count; k++) {
        const int row = qb_find(node, (uint16_t)(pdo->entries[k] >> 16), (uint8_t)(pdo->entries[k] >> 8), &missing);
        int64_t value = 0;
        if (row >= 0) {
            qb_read(net, node, row, &value);
        }
        qb_pack(data, pdo->sizes[k], value);
        data += pdo->sizes[k];
    }
}

void qb_tpdo_compile(qb_network *net, int node, int number)
{
    qb_pdo *pdo = tpdo_of(net, node, number);
    pdo->syncs = 0;
    pdo->awaits_start = pdo->sync_start != 0;
    qb_tpdo_data(net, node, number, pdo->sampled);
    pdo->event_pending = 1;
}

static int has_changed(qb_network *net, int node, int number)
{
    qb_pdo *pdo = tpdo_of(net, node, number);
    uint8_t data[8];
    int due;
    qb_tpdo_data(net, node, number, data);
    due = pdo->event_pending || memcmp(data, pdo->sampled, sizeof data) != 0;
    memcpy(pdo->sampled, data, sizeof data);
    pdo->event_pending = 0;
    return due;
}

int qb_tpdo_due(qb_network *net, int node, int number)
{
    qb_pdo *pdo = tpdo_of(net, node, number);
    const int counter = net->nodes[node].sync.counter;
    if (pdo->type == 1 && !pdo->awaits_start) {
        return 1;
    }
    if (pdo->type == 0) {
        return has_changed(net, node, number);
    }
    if (pdo->awaits_start && counter) {
        if (counter != pdo->sync_start) {
            return 0;
        }
        /* The SYNC with the start value counts as the first one: the PDO goes out with it. */
        pdo->awaits_start = 0;
        pdo->syncs = pdo->type - 1;
    }
    if (++pdo->syncs < pdo->type) {
        return 0;
    }
    pdo->syncs = 0;
    return 1;
}

void qb_tpdo_sample(qb_network *net, int node, int number)
{
    qb_pdo *pdo = tpdo_of(net, node, number);
    if (pdo->type == SAMPLED_FOR_REMOTE) {
        qb_tpdo_data(net, node, number, pdo->sampled);
    }
}

void qb_tpdo_remote(qb_network *net, int node, int number)
{
    const qb_pdo *pdo = tpdo_of(net, node, number);
    uint8_t data[8];
    qb_tpdo_data(net, node, number, data);
    qb_send(net, node, pdo->cob_id & 0x7FF, pdo->type == SAMPLED_FOR_REMOTE ? pdo->sampled : data, pdo->length);
}

static void restart_event_timer(qb_network *net, int node, int number)
{
    const qb_pdo *pdo = tpdo_of(net, node, number);
    qb_stop_timer(net, node, QB_T_EVENT + number);
    if (pdo->event_timer > 0) {
        qb_set_timer(net, node, QB_T_EVENT + number, pdo->event_timer);
    }
}

static void transmit(qb_network *net, int node, int number, const uint8_t *data)
{
    qb_pdo *pdo = tpdo_of(net, node, number);
    pdo->event_pending = pdo->overdue = 0;
    memcpy(pdo->sent, data, sizeof pdo->sent);
    qb_send(net, node, pdo->cob_id & 0x7FF, pdo->sent, pdo->length);
    if (pdo->inhibit_time > 0) {
        /* Nothing is looked at meanwhile: whatever changes goes out at the end of it. */
        qb_stop_timer(net, node, QB_T_LOOK + number);
        qb_set_timer(net, node, QB_T_INHIBIT + number, pdo->inhibit_time);
    } else if (!qb_timer_runs(net, node, QB_T_LOOK + number)) {
        qb_set_timer(net, node, QB_T_LOOK + number, LOOKS_EVERY);
    }
    restart_event_timer(net, node, number);
}

static void transmit_present(qb_network *net, int node, int number)
{
    uint8_t data[8];
    qb_tpdo_data(net, node, number, data);
    transmit(net, node, number, data);
}

static void send_news(qb_network *net, int node, int number)
{
    qb_pdo *pdo = tpdo_of(net, node, number);
    uint8_t data[8];
    pdo->event_pending = 0;
    qb_tpdo_data(net, node, number, data);
    if (memcmp(data, pdo->sent, sizeof data) != 0) {
        transmit(net, node, number, data);
    }
}

void qb_tpdo_enable(qb_network *net, int node, int number, int enabled)
{
    qb_pdo *pdo = tpdo_of(net, node, number);
    const int starting = enabled && !pdo->enabled;
    qb_stop_timer(net, node, QB_T_EVENT + number);
    qb_stop_timer(net, node, QB_T_INHIBIT + number);
    qb_stop_timer(net, node, QB_T_LOOK + number);
    pdo->overdue = 0;
    pdo->enabled = enabled;
    if (starting) {
        transmit_present(net, node, number);
    } else if (enabled) {
        restart_event_timer(net, node, number);
        qb_set_timer(net, node, QB_T_LOOK + number, LOOKS_EVERY);
    }
}

void qb_tpdo_event(qb_network *net, int node)
{
    int k;
    for (k = 0; k < QB_PDOS; k++) {
        qb_pdo *pdo = tpdo_of(net, node, k);
        pdo->event_pending = 1;
        if (pdo->enabled && !qb_timer_runs(net, node, QB_T_INHIBIT + k)) {
            send_news(net, node, k);
        }
    }
}

static void compare(qb_network *net, int node, int number)
{
    send_news(net, node, number);
    if (!qb_timer_runs(net, node, QB_T_INHIBIT + number) && !qb_timer_runs(net, node, QB_T_LOOK + number)) {
        qb_set_timer(net, node, QB_T_LOOK + number, LOOKS_EVERY);
    }
}

static void expire(qb_network *net, int node, int number)
{
    if (qb_timer_runs(net, node, QB_T_INHIBIT + number)) {
        tpdo_of(net, node, number)->overdue = 1;
    } else {
        transmit_present(net, node, number);
    }
}

void qb_tpdo_timer(qb_network *net, int node, int timer)
{
    if (timer >= QB_T_LOOK) {
        compare(net, node, timer - QB_T_LOOK);
    } else if (timer >= QB_T_INHIBIT) {
        const int number = timer - QB_T_INHIBIT;
        if (tpdo_of(net, node, number)->overdue) {
            transmit_present(net, node, number);
        } else {
            compare(net, node, number);
        }
    } else {
        expire(net, node, timer - QB_T_EVENT);
    }
}
