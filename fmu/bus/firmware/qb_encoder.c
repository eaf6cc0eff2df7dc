/* CiA 406: scaled absolute position with preset, code sequence, speed, cyclic timer. */
#include <math.h>

#include "qb_calls.h"

#define COUNTER_CLOCKWISE 1
#define SCALING 4
#define SYNC_PAUSE 0.05 /* without a SYNC, after which the speed is measured from reading to reading [s] */
#define SPEED_LIMIT 32767

static qb_encoder *encoder_of(qb_network *net, int node) { return &net->nodes[node].encoder; }

static int64_t modulo(int64_t value, int64_t modulus)
{
    const int64_t rest = value % modulus;
    return rest < 0 ? rest + modulus : rest;
}

/* Of the code disc, 32 bits. */
static int64_t physical(const qb_network *net, int node)
{
    const int place = qb_place_of(node);
    const double exact = qb_discs[place].scale * net->steering_angle[place];
    return modulo(qb_discs[place].zero + (int64_t)rint(exact + net->steering_dither[place]), (int64_t)1 << 32);
}

static int64_t scaled(const qb_network *net, int node)
{
    const qb_encoder *me = &net->nodes[node].encoder;
    int64_t position = physical(net, node) % QB_ENCODER_COUNTS;
    if (me->operating & COUNTER_CLOCKWISE) {
        position = modulo(-position, QB_ENCODER_COUNTS);
    }
    return me->operating & SCALING ? position * me->units / QB_ENCODER_COUNTS : position;
}

/* Where the position value starts again at zero. */
static int64_t modulus_of(const qb_encoder *me) { return me->operating & SCALING ? me->range : QB_ENCODER_COUNTS; }

static int64_t position_of(const qb_network *net, int node)
{
    const qb_encoder *me = &net->nodes[node].encoder;
    return modulo(scaled(net, node) + me->offset, modulus_of(me));
}

void qb_encoder_reset(qb_network *net, int node)
{
    qb_encoder *me = encoder_of(net, node);
    me->operating = (uint16_t)qb_value(net, node, 0x6000, 0, SCALING);
    me->units = qb_value(net, node, 0x6001, 0, QB_ENCODER_COUNTS);
    me->range = qb_value(net, node, 0x6002, 0, QB_ENCODER_COUNTS);
    me->offset = me->speed = 0;
    me->has_last = 0;
}

void qb_encoder_sample(qb_network *net, int node)
{
    qb_encoder *me = encoder_of(net, node);
    const int64_t position = position_of(net, node);
    if (me->has_last && net->now > me->last_at) {
        const int64_t modulus = modulus_of(me);
        const int64_t moved = modulo(position - me->last_position + modulus / 2, modulus) - modulus / 2;
        me->speed = (int64_t)rint((double)moved / ((double)net->now / 1e9 - (double)me->last_at / 1e9));
    }
    if (!me->has_last || net->now > me->last_at) {
        me->has_last = 1;
        me->last_at = net->now;
        me->last_position = position;
    }
}

static int64_t measured_speed(qb_network *net, int node)
{
    qb_encoder *me = encoder_of(net, node);
    if (!me->has_last || (double)net->now / 1e9 - (double)me->last_at / 1e9 > SYNC_PAUSE) {
        qb_encoder_sample(net, node);
    }
    return me->speed > SPEED_LIMIT ? SPEED_LIMIT : me->speed < -SPEED_LIMIT ? -SPEED_LIMIT : me->speed;
}

int qb_encoder_read(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t *value)
{
    const qb_encoder *me = encoder_of(net, node);
    switch (index) {
    case 0x6004: *value = position_of(net, node); return 1;
    case 0x6030:
        if (subindex == 1) {
            *value = measured_speed(net, node);
        }
        return subindex == 1;
    case 0x6500: *value = me->operating; return 1;
    case 0x6501: *value = QB_ENCODER_COUNTS; return 1;
    case 0x6509: *value = me->offset; return 1;
    case 0x650A: *value = QB_ENCODER_COUNTS - 1; return subindex == 3;
    default: return 0;
    }
}

qb_abort qb_encoder_write(qb_network *net, int node, uint16_t index, int64_t value)
{
    qb_encoder *me = encoder_of(net, node);
    qb_abort missing;
    int row;
    switch (index) {
    case 0x6000:
        if (value & ~(COUNTER_CLOCKWISE | SCALING)) {
            return QB_VALUE_RANGE_EXCEEDED;
        }
        me->operating = (uint16_t)value;
        break;
    case 0x6001:
    case 0x6002:
        if (value > QB_ENCODER_COUNTS) {
            return QB_VALUE_TOO_HIGH;
        }
        *(index == 0x6001 ? &me->units : &me->range) = value;
        break;
    case 0x6003:
        if (value > modulus_of(me) - 1) {
            return QB_VALUE_TOO_HIGH;
        }
        me->offset = value - scaled(net, node);
        break;
    case 0x6200: /* the event timer of the first TPDO under another name */
        row = qb_find(node, 0x1800, 5, &missing);
        return row < 0 ? QB_FINE : qb_write(net, node, row, value);
    default: return QB_FINE;
    }
    me->has_last = 0;
    return QB_FINE;
}
