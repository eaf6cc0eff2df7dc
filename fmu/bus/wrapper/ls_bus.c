/* Operations of FMI-LS-BUS 1.0 for CAN, as bytes: little endian, one after the other in Rx_Data and Tx_Data. */
#include <string.h>

#include "bus.h"

enum {
    FORMAT_ERROR = 0x01,
    CAN_TRANSMIT = 0x10,
    CAN_FD_TRANSMIT = 0x11,
    CAN_XL_TRANSMIT = 0x12,
    CONFIRM = 0x20,
    ARBITRATION_LOST = 0x30,
    BUS_ERROR = 0x31,
    CONFIGURATION = 0x40,
    STATUS = 0x41,
    WAKE_UP = 0x42
};

enum { HEADER = 8, TRANSMIT_HEAD = 16, CAN_BAUD_RATE = 1, ARBITRATION_LOST_BEHAVIOR = 4, BUFFER_AND_RETRANSMIT = 1 };

#define LONGEST_QUOTED 256 /* bytes of an operation that a format error quotes */

static uint8_t *reserve(qb_bus *me, size_t size)
{
    uint8_t *place = me->now.tx + me->now.tx_size;
    if (size > sizeof me->now.tx - me->now.tx_size) {
        return NULL;
    }
    me->now.tx_size += size;
    memset(place, 0, size);
    return place;
}

static void head(uint8_t *place, uint32_t code, size_t size)
{
    qb_pack(place, 4, code);
    qb_pack(place + 4, 4, (int64_t)size);
}

/* What the bus simulation has to know before the first frame. */
static void configure_once(qb_bus *me)
{
    uint8_t *place;
    if (me->now.configured) {
        return;
    }
    me->now.configured = 1;
    place = reserve(me, HEADER + 5);
    if (place != NULL) {
        head(place, CONFIGURATION, HEADER + 5);
        place[HEADER] = CAN_BAUD_RATE;
        qb_pack(place + HEADER + 1, 4, QB_BIT_RATE);
    }
    place = reserve(me, HEADER + 2);
    if (place != NULL) {
        head(place, CONFIGURATION, HEADER + 2);
        place[HEADER] = ARBITRATION_LOST_BEHAVIOR;
        place[HEADER + 1] = BUFFER_AND_RETRANSMIT;
    }
}

/* Frames that find no room in Tx_Data stay for its next tick. */
void qb_give_operations(qb_bus *me)
{
    qb_network *net = &me->now.net;
    int sent = 0;
    configure_once(me);
    for (; sent < net->queued; sent++) {
        const qb_frame *frame = &net->queue[sent];
        uint8_t *place = reserve(me, TRANSMIT_HEAD + (size_t)frame->length);
        if (place == NULL) {
            break;
        }
        head(place, CAN_TRANSMIT, TRANSMIT_HEAD + (size_t)frame->length);
        qb_pack(place + 8, 4, frame->id);
        qb_pack(place + 14, 2, frame->length);
        memcpy(place + TRANSMIT_HEAD, frame->data, frame->length);
    }
    net->queued -= sent;
    memmove(net->queue, net->queue + sent, sizeof net->queue[0] * (size_t)net->queued);
}

static void complain(qb_bus *me, const uint8_t *operation, size_t size)
{
    const size_t quoted = size > LONGEST_QUOTED ? LONGEST_QUOTED : size;
    uint8_t *place = reserve(me, HEADER + 2 + quoted);
    if (place != NULL) {
        head(place, FORMAT_ERROR, HEADER + 2 + quoted);
        qb_pack(place + HEADER, 2, (int64_t)quoted);
        memcpy(place + HEADER + 2, operation, quoted);
    }
    qo_tell(&me->plant, QO_ANSWER_OK, "Rx_Data holds an operation that is none of FMI-LS-BUS for CAN; answered by a "
                                     "format error.");
}

/* A frame with an identifier of 11 bits; others are not for CANopen devices. */
static int transmit(qb_bus *me, const uint8_t *operation, size_t size)
{
    const int64_t length = qb_unpack(operation + 14, 2, 0);
    qb_frame frame = {0, 0, {0}};
    if (size < TRANSMIT_HEAD || length > 8 || size != TRANSMIT_HEAD + (size_t)length || operation[12] > 1 ||
        operation[13] > 1) {
        return 0;
    }
    frame.id = (uint32_t)qb_unpack(operation + 8, 4, 0);
    frame.length = (uint8_t)length;
    memcpy(frame.data, operation + TRANSMIT_HEAD, (size_t)length);
    if (operation[12] || frame.id > 0x7FF) {
        return 1;
    }
    if (operation[13]) {
        qb_receive_remote(&me->now.net, frame.id);
    } else {
        qb_receive(&me->now.net, &frame);
    }
    return 1;
}

static int take(qb_bus *me, const uint8_t *operation, size_t size)
{
    switch (qb_unpack(operation, 4, 0)) {
    case CAN_TRANSMIT: return size >= TRANSMIT_HEAD && transmit(me, operation, size);
    case CONFIRM:
    case ARBITRATION_LOST: return size == HEADER + 4;
    case BUS_ERROR: return size == HEADER + 7;
    /* Nothing of these is for a device of CAN 2.0 that sends and forgets. */
    case FORMAT_ERROR:
    case CAN_FD_TRANSMIT:
    case CAN_XL_TRANSMIT:
    case CONFIGURATION:
    case STATUS:
    case WAKE_UP: return 1;
    default: return 0;
    }
}

void qb_take_operations(qb_bus *me)
{
    const uint8_t *operation = me->now.rx;
    size_t left = me->now.rx_size;
    configure_once(me);
    while (left > 0) {
        const size_t size = left < HEADER ? 0 : (size_t)qb_unpack(operation + 4, 4, 0);
        if (size < HEADER || size > left) {
            complain(me, operation, left);
            break;
        }
        if (!take(me, operation, size)) {
            complain(me, operation, size);
        }
        operation += size;
        left -= size;
    }
    me->now.rx_size = 0;
}

int qb_has_news(const qb_bus *me)
{
    return me->now.net.queued > 0 || me->now.tx_size > 0 || !me->now.configured;
}

int64_t qb_next_tick(const qb_bus *me)
{
    return qb_has_news(me) ? me->now.net.now : qb_next_event(&me->now.net);
}
