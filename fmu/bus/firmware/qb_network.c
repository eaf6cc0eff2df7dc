/* All devices on one bus: frames in, frames out, and time. */
#include <string.h>

#include "qb_calls.h"

#define FRAME_TIME 135000LL /* when the other nodes hear a frame of a node: 135 bits at 1 Mbit/s [ns] */
#define IDENTIFIER 0x1FFFFFFFu

void qb_set_timer(qb_network *net, int node, int timer, int64_t delay)
{
    net->nodes[node].timers[timer].due = net->now + delay;
    net->nodes[node].timers[timer].serial = ++net->serial;
}

void qb_stop_timer(qb_network *net, int node, int timer) { net->nodes[node].timers[timer].due = QB_NEVER; }

int qb_timer_runs(const qb_network *net, int node, int timer)
{
    return net->nodes[node].timers[timer].due != QB_NEVER;
}

static int hears_sync(const qb_network *net, int node, uint32_t id)
{
    return (net->nodes[node].sync.cob_id & IDENTIFIER) == id;
}

static int hears_rpdo(const qb_network *net, int node, int number, uint32_t id)
{
    const qb_pdo *pdo = &net->nodes[node].rpdos[number];
    return pdo->wired && (pdo->cob_id & 0x7FF) == id;
}

static int listens(const qb_network *net, int node, uint32_t id)
{
    int k, any = id == 0 || id == 0x600u + qb_places[node].id || hears_sync(net, node, id) || qb_consumes(net, node, id);
    for (k = 0; k < QB_PDOS; k++) {
        any |= hears_rpdo(net, node, k, id);
    }
    return any;
}

static void put(qb_network *net, uint32_t id, const uint8_t *data, int length)
{
    qb_frame *frame = &net->queue[net->queued];
    if (net->queued == QB_QUEUE) {
        net->lost++;
        return;
    }
    memset(frame, 0, sizeof *frame);
    frame->id = id;
    frame->length = (uint8_t)length;
    if (length > 0) {
        memcpy(frame->data, data, (size_t)length);
    }
    net->queued++;
}

/* One after the other, when the last bit has left the wire: PDOs that answer PDOs take time, as on a real bus. */
static void let_others_hear(qb_network *net, int node, uint32_t id, const uint8_t *data, int length)
{
    qb_flying *flying;
    if (net->in_flight == QB_FLYING) {
        return;
    }
    flying = &net->flying[(net->first_flying + net->in_flight++) % QB_FLYING];
    memset(flying, 0, sizeof *flying);
    flying->origin = node;
    flying->frame.id = id;
    flying->frame.length = (uint8_t)length;
    memcpy(flying->frame.data, data, (size_t)length);
    net->free_at = (net->free_at > net->now ? net->free_at : net->now) + FRAME_TIME;
    flying->timer.due = net->free_at;
    flying->timer.serial = ++net->serial;
}

void qb_send(qb_network *net, int node, uint32_t id, const uint8_t *data, int length)
{
    int other, heard = 0;
    put(net, id, data, length);
    for (other = 0; other < QB_NODES && !heard; other++) {
        heard = listens(net, other, id);
    }
    if (heard) {
        let_others_hear(net, node, id, data, length);
    }
}

typedef struct {
    qb_frame frame;
    int node;
} answer;

/* The TPDOs that go out with a SYNC. All nodes ask for the bus at once: the lowest identifier wins the arbitration. */
static void send_with_sync(qb_network *net, const int *nodes, int count)
{
    answer answers[QB_NODES * QB_PDOS];
    int n, k, known = 0;
    for (n = 0; n < count; n++) {
        for (k = 0; k < QB_PDOS; k++) {
            const qb_pdo *pdo = &net->nodes[nodes[n]].tpdos[k];
            if (pdo->wired && pdo->type <= 240 && qb_tpdo_due(net, nodes[n], k)) {
                answer next;
                int place = known++;
                next.node = nodes[n];
                next.frame.id = pdo->cob_id & 0x7FF;
                next.frame.length = pdo->length;
                qb_tpdo_data(net, nodes[n], k, next.frame.data);
                for (; place > 0 && answers[place - 1].frame.id > next.frame.id; place--) {
                    answers[place] = answers[place - 1];
                }
                answers[place] = next;
            }
        }
    }
    for (n = 0; n < known; n++) {
        qb_send(net, answers[n].node, answers[n].frame.id, answers[n].frame.data, answers[n].frame.length);
    }
}

static void synchronise(qb_network *net, const qb_frame *frame, int origin)
{
    int nodes[QB_NODES], node, count = 0, n;
    for (node = 0; node < QB_NODES; node++) {
        if (node != origin && hears_sync(net, node, frame->id)) {
            nodes[count++] = node;
        }
    }
    for (n = 0, node = 0; n < count; n++) {
        if (qb_accepts_sync(net, nodes[n], frame)) {
            nodes[node++] = nodes[n];
        }
    }
    for (n = 0; n < node; n++) {
        qb_latch(net, nodes[n]);
    }
    send_with_sync(net, nodes, node);
}

/* What the nodes do with a data frame; the one that has sent it does not hear it. */
static void distribute(qb_network *net, const qb_frame *frame, int origin)
{
    int node, k;
    synchronise(net, frame, origin);
    for (node = 0; node < QB_NODES; node++) {
        if (node == origin) {
            continue;
        }
        if (frame->id == 0) {
            qb_nmt_receive(net, node, frame);
        } else if (frame->id == 0x600u + qb_places[node].id && qb_talks(net, node)) {
            qb_sdo_receive(net, node, frame);
        }
        if (qb_consumes(net, node, frame->id)) {
            qb_heartbeat_receive(net, node, frame->id);
        }
        for (k = 0; k < QB_PDOS; k++) {
            if (hears_rpdo(net, node, k, frame->id)) {
                qb_rpdo_receive(net, node, k, frame);
            }
        }
    }
}

void qb_produce_sync(qb_network *net, int node, uint32_t id, const uint8_t *data, int length)
{
    qb_frame frame = {0, 0, {0}};
    (void)node;
    frame.id = id;
    frame.length = (uint8_t)length;
    memcpy(frame.data, data, (size_t)length);
    put(net, id, data, length);
    distribute(net, &frame, -1);
}

void qb_receive(qb_network *net, const qb_frame *frame) { distribute(net, frame, -1); }

void qb_receive_remote(qb_network *net, uint32_t id)
{
    int node, k;
    for (node = 0; node < QB_NODES; node++) {
        if (id == 0x700u + qb_places[node].id) {
            qb_guarding_answer(net, node);
        }
        for (k = 0; k < QB_PDOS; k++) {
            const qb_pdo *pdo = &net->nodes[node].tpdos[k];
            if (pdo->wired && !(pdo->cob_id & 0x40000000u) && (pdo->cob_id & 0x7FF) == id) {
                qb_tpdo_remote(net, node, k);
            }
        }
    }
}

void qb_start(qb_network *net)
{
    int node, timer;
    memset(net, 0, sizeof *net);
    qb_stage_start(net);
    for (node = 0; node < QB_NODES; node++) {
        for (timer = 0; timer < QB_NODE_TIMERS; timer++) {
            qb_stop_timer(net, node, timer);
        }
        net->nodes[node].drive.read_at = -1000000000;
        net->nodes[node].drive.position_sign = net->nodes[node].drive.velocity_sign = 1;
        for (timer = 0; timer < QB_PDOS; timer++) {
            net->nodes[node].rpdos[timer].cob_id = net->nodes[node].tpdos[timer].cob_id = 0x80000000u;
            net->nodes[node].rpdos[timer].type = net->nodes[node].tpdos[timer].type = 255;
        }
        qb_restore(net, node, 0xFFFF);
        net->nodes[node].encoder.units = net->nodes[node].encoder.range = QB_ENCODER_COUNTS;
        net->nodes[node].sync.cob_id = (uint32_t)qb_value(net, node, 0x1005, 0, 0x080);
    }
    for (node = 0; node < QB_NODES; node++) {
        qb_nmt_reset(net, node, 1);
    }
}

/* The timer that is due next: its place in *node and *timer, QB_NODES where a frame in flight is heard. */
static const qb_timer *next_timer(const qb_network *net, int *node, int *timer)
{
    static const qb_timer never = {QB_NEVER, 0};
    const qb_timer *best = &never;
    int n, t;
    *node = QB_NODES;
    *timer = 0;
    if (net->in_flight > 0) {
        best = &net->flying[net->first_flying].timer;
    }
    for (n = 0; n < QB_NODES; n++) {
        for (t = 0; t < QB_NODE_TIMERS; t++) {
            const qb_timer *other = &net->nodes[n].timers[t];
            if (other->due < best->due || (other->due == best->due && other->due != QB_NEVER && other->serial < best->serial)) {
                best = other;
                *node = n;
                *timer = t;
            }
        }
    }
    return best;
}

int64_t qb_next_event(const qb_network *net)
{
    int node, timer;
    return next_timer(net, &node, &timer)->due;
}

static void hear(qb_network *net)
{
    const qb_flying flying = net->flying[net->first_flying];
    net->first_flying = (net->first_flying + 1) % QB_FLYING;
    net->in_flight--;
    distribute(net, &flying.frame, flying.origin);
}

static void run_timer(qb_network *net, int node, int timer)
{
    if (node == QB_NODES) {
        hear(net);
        return;
    }
    if (timer == QB_T_SDO) {
        qb_sdo_timer(net, node);
    } else if (timer == QB_T_EMERGENCY) {
        qb_emergency_timer(net, node);
    } else if (timer == QB_T_TICK) {
        qb_drive_tick(net, node);
    } else if (timer >= QB_T_RPDO) {
        qb_rpdo_timer(net, node, timer - QB_T_RPDO);
    } else if (timer >= QB_T_EVENT) {
        qb_tpdo_timer(net, node, timer);
    } else {
        qb_node_timer(net, node, timer);
    }
}

int qb_advance(qb_network *net, int64_t instant, int (*move)(void *context, qb_network *net), void *context)
{
    int node, timer;
    const qb_timer *next;
    while ((next = next_timer(net, &node, &timer))->due <= instant) {
        net->now = next->due > net->now ? next->due : net->now;
        if (node < QB_NODES) {
            qb_stop_timer(net, node, timer);
        }
        if (!move(context, net)) {
            return 0;
        }
        run_timer(net, node, timer);
    }
    net->now = instant > net->now ? instant : net->now;
    return move(context, net);
}
