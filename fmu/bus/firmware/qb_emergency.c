/* Emergency producer: error register 1001h, history 1003h, EMCY 1014h, inhibit time 1015h (CiA 301, 7.2.7). */
#include <string.h>

#include "qb_calls.h"

#define INVALID 0x80000000u
#define INHIBIT_UNIT (QB_MILLISECOND / 10)

enum { GENERIC = 0x01, COMMUNICATION = 0x10 };

static void send_next(qb_network *net, int node);

uint32_t qb_emergency_cob_id(qb_network *net, int node)
{
    return (uint32_t)qb_value(net, node, 0x1014, 0, 0x080 + qb_places[node].id);
}

uint8_t qb_error_register(const qb_network *net, int node)
{
    const qb_emergency *me = &net->nodes[node].emergency;
    int value = 0, k;
    for (k = 0; k < me->count; k++) {
        value |= GENERIC | (me->errors[k].of_device ? me->errors[k].information : COMMUNICATION);
    }
    return (uint8_t)value;
}

static void forget(qb_emergency *me, int position)
{
    me->count--;
    memmove(me->errors + position, me->errors + position + 1, sizeof me->errors[0] * (size_t)(me->count - position));
}

static void forget_all(qb_emergency *me, int of_device)
{
    int k;
    for (k = me->count - 1; k >= 0; k--) {
        if (me->errors[k].of_device == of_device) {
            forget(me, k);
        }
    }
}

void qb_emergency_reset(qb_network *net, int node, int application)
{
    qb_emergency *me = &net->nodes[node].emergency;
    forget_all(me, 0);
    if (application) {
        forget_all(me, 1);
        me->known = me->length = 0;
    }
}

/* Position of an error, -1 where there is none; `information` of an error of the communication counts unless it is any. */
static int find(const qb_emergency *me, uint16_t code, int of_device, int information)
{
    int k;
    for (k = 0; k < me->count; k++) {
        const qb_error *error = &me->errors[k];
        if (error->code == code && error->of_device == of_device &&
            (information == QB_ANY_SOURCE || error->information == information)) {
            return k;
        }
    }
    return -1;
}

static void add(qb_emergency *me, uint16_t code, uint16_t information, int of_device)
{
    if (me->count < QB_ERRORS) {
        const qb_error error = {code, information, of_device};
        me->errors[me->count++] = error;
    }
}

static void transmit(qb_network *net, int node, uint16_t code, uint16_t information)
{
    qb_emergency *me = &net->nodes[node].emergency;
    uint8_t *data;
    if (me->length == QB_EMERGENCIES) {
        me->first = (me->first + 1) % QB_EMERGENCIES;
        me->length--;
    }
    data = me->waiting[(me->first + me->length++) % QB_EMERGENCIES];
    memset(data, 0, 8);
    qb_pack(data, 2, code);
    data[2] = qb_error_register(net, node);
    qb_pack(data + 3, 2, information);
    if (!me->inhibited) {
        send_next(net, node);
    }
}

static void send_next(qb_network *net, int node)
{
    qb_emergency *me = &net->nodes[node].emergency;
    me->inhibited = 0;
    while (me->length > 0 && !me->inhibited) {
        const uint32_t cob_id = qb_emergency_cob_id(net, node);
        const int64_t inhibit = qb_value(net, node, 0x1015, 0, 0);
        uint8_t data[8];
        memcpy(data, me->waiting[me->first], sizeof data);
        me->first = (me->first + 1) % QB_EMERGENCIES;
        me->length--;
        if (!(cob_id & INVALID) && qb_talks(net, node)) {
            qb_send(net, node, cob_id & 0x7FF, data, 8);
        }
        if (inhibit > 0) {
            me->inhibited = 1;
            qb_set_timer(net, node, QB_T_EMERGENCY, inhibit * INHIBIT_UNIT);
        }
    }
}

void qb_emergency_timer(qb_network *net, int node) { send_next(net, node); }

static void announce(qb_network *net, int node, int known, uint16_t code, uint16_t information)
{
    qb_emergency *me = &net->nodes[node].emergency;
    if (known) {
        return;
    }
    memmove(me->history + 1, me->history, sizeof me->history[0] * (QB_HISTORY - 1));
    me->history[0] = code | (uint32_t)information << 16;
    me->known += me->known < QB_HISTORY;
    transmit(net, node, code, information);
}

void qb_report(qb_network *net, int node, uint16_t code, uint8_t bits)
{
    qb_emergency *me = &net->nodes[node].emergency;
    const int own = find(me, code, 1, QB_ANY_SOURCE);
    const int known = own >= 0 || find(me, code, 0, QB_ANY_SOURCE) >= 0;
    if (own >= 0) {
        me->errors[own].information |= bits;
    } else {
        add(me, code, bits, 1);
    }
    announce(net, node, known, code, 0);
}

void qb_clear_errors(qb_network *net, int node)
{
    forget_all(&net->nodes[node].emergency, 1);
    transmit(net, node, 0, 0);
}

void qb_report_communication(qb_network *net, int node, uint16_t code, uint16_t information)
{
    qb_emergency *me = &net->nodes[node].emergency;
    const int there = find(me, code, 0, information) >= 0;
    const int known = there || find(me, code, 1, QB_ANY_SOURCE) >= 0;
    if (!there) {
        add(me, code, information, 0);
    }
    announce(net, node, known, code, information);
}

void qb_end_communication(qb_network *net, int node, uint16_t code, int information)
{
    qb_emergency *me = &net->nodes[node].emergency;
    int position = find(me, code, 0, information), ended = 0;
    while (position >= 0) {
        forget(me, position);
        ended = 1;
        position = find(me, code, 0, information);
    }
    if (ended && find(me, code, 0, QB_ANY_SOURCE) < 0 && find(me, code, 1, QB_ANY_SOURCE) < 0) {
        transmit(net, node, 0, 0);
    }
}
