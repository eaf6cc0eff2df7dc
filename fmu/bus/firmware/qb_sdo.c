/* The default SDO server (CiA 301, 7.2.4): expedited and segmented transfer, one at a time, whatever the client sends. */
#include <string.h>

#include "qb_calls.h"

#define TIMEOUT (1000 * QB_MILLISECOND) /* without a frame of the client */
#define SEGMENT 7
#define ABORT 0x80
#define EXPEDITED 0x02
#define SIZE_INDICATED 0x01
#define LAST 0x01
#define TOGGLE 0x10

static void answer(qb_network *net, int node, const uint8_t *frame)
{
    qb_send(net, node, 0x580u + qb_places[node].id, frame, 8);
}

static void answer_about(qb_network *net, int node, uint8_t command, uint16_t index, uint8_t subindex,
                         const uint8_t *data, int size)
{
    uint8_t frame[8] = {0};
    frame[0] = command;
    qb_pack(frame + 1, 2, index);
    frame[3] = subindex;
    if (size > 0) {
        memcpy(frame + 4, data, (size_t)size);
    }
    answer(net, node, frame);
}

static void give_up(qb_network *net, int node, uint16_t index, uint8_t subindex, qb_abort code)
{
    uint8_t bytes[4];
    qb_pack(bytes, 4, code);
    net->nodes[node].sdo.transfer = QB_NO_TRANSFER;
    answer_about(net, node, ABORT, index, subindex, bytes, 4);
}

static uint16_t index_of(const uint8_t *frame) { return (uint16_t)(frame[1] | frame[2] << 8); }

/* Whether a frame begins a transfer: its command specifier, and the bits that have to be zero. */
static int initiates(const uint8_t *frame)
{
    static const int forbidden[8] = {-1, 0x00, 0x00, -1, -1, 0x03, 0x01, -1};
    const int bits = forbidden[frame[0] >> 5];
    return bits >= 0 && !(frame[0] & bits);
}

static qb_abort fits(const qb_object *object, uint32_t size)
{
    if (size > object->size) {
        return QB_TOO_LONG;
    }
    return size < object->size ? QB_TOO_SHORT : QB_FINE;
}

/* The row of an object that can be written with so many bytes, where the client says how many. */
static qb_abort find_target(int node, uint16_t index, uint8_t subindex, int announced, uint32_t size, int *row)
{
    qb_abort missing;
    *row = qb_find(node, index, subindex, &missing);
    if (*row < 0) {
        return missing;
    }
    if (!(qb_row(node, *row)->flags & QB_WRITABLE)) {
        return QB_READ_ONLY;
    }
    return announced ? fits(qb_row(node, *row), size) : QB_FINE;
}

static qb_abort store(qb_network *net, int node, int row, const uint8_t *data)
{
    const qb_object *object = qb_row(node, row);
    const int64_t value = qb_unpack(data, object->size, object->flags & QB_SIGNED);
    const qb_abort refusal = qb_check(node, row, value);
    return refusal != QB_FINE ? refusal : qb_write(net, node, row, value);
}

static qb_abort initiate_download(qb_network *net, int node, const uint8_t *frame)
{
    qb_sdo *sdo = &net->nodes[node].sdo;
    const int announced = frame[0] & SIZE_INDICATED;
    const int expedited = frame[0] & EXPEDITED;
    const uint32_t size = expedited ? 4u - (frame[0] >> 2 & 3) : (uint32_t)qb_unpack(frame + 4, 4, 0);
    int row;
    qb_abort refusal = find_target(node, index_of(frame), frame[3], announced, size, &row);
    if (refusal != QB_FINE) {
        return refusal;
    }
    if (expedited) {
        if (qb_row(node, row)->size > 4) {
            return QB_TOO_SHORT;
        }
        refusal = store(net, node, row, frame + 4);
        if (refusal != QB_FINE) {
            return refusal;
        }
    } else {
        memset(sdo, 0, sizeof *sdo);
        sdo->transfer = QB_SEGMENTED_DOWNLOAD;
        sdo->index = index_of(frame);
        sdo->subindex = frame[3];
        sdo->row = row;
        sdo->announced = announced;
        sdo->size = size;
    }
    answer_about(net, node, 0x60, index_of(frame), frame[3], NULL, 0);
    return QB_FINE;
}

static qb_abort initiate_upload(qb_network *net, int node, const uint8_t *frame)
{
    qb_sdo *sdo = &net->nodes[node].sdo;
    const qb_object *object;
    uint8_t bytes[QB_LONGEST];
    uint32_t size;
    int64_t value = 0;
    qb_abort refusal;
    const int row = qb_find(node, index_of(frame), frame[3], &refusal);
    if (row < 0) {
        return refusal;
    }
    object = qb_row(node, row);
    if (!(object->flags & QB_READABLE)) {
        return QB_WRITE_ONLY;
    }
    size = object->size;
    if (object->flags & QB_TEXT) {
        size = qb_texts[object->start].size;
        memcpy(bytes, qb_texts[object->start].bytes, size <= 4 ? size : 0);
    } else {
        refusal = qb_read(net, node, row, &value);
        if (refusal != QB_FINE) {
            return refusal;
        }
        qb_pack(bytes, object->size, value);
    }
    if (size >= 1 && size <= 4) {
        answer_about(net, node, (uint8_t)(0x43 | (4 - size) << 2), index_of(frame), frame[3], bytes, (int)size);
        return QB_FINE;
    }
    memset(sdo, 0, sizeof *sdo);
    sdo->transfer = QB_SEGMENTED_UPLOAD;
    sdo->index = index_of(frame);
    sdo->subindex = frame[3];
    sdo->row = row;
    sdo->size = size;
    if (!(object->flags & QB_TEXT)) {
        memcpy(sdo->data, bytes, sizeof sdo->data);
    }
    qb_pack(bytes, 4, size);
    answer_about(net, node, 0x41, index_of(frame), frame[3], bytes, 4);
    return QB_FINE;
}

static qb_abort take_segment(qb_network *net, int node, const uint8_t *frame)
{
    qb_sdo *sdo = &net->nodes[node].sdo;
    const qb_object *object = qb_row(node, sdo->row);
    const uint32_t size = SEGMENT - (frame[0] >> 1 & 7u);
    uint8_t confirmation[8] = {0};
    qb_abort refusal;
    if (frame[0] >> 5 != 0) {
        return QB_COMMAND_SPECIFIER;
    }
    if ((frame[0] & TOGGLE) != sdo->toggle) {
        return QB_TOGGLE_BIT;
    }
    if (sdo->done + size > object->size) {
        return QB_TOO_LONG;
    }
    memcpy(sdo->data + sdo->done, frame + 1, size);
    sdo->done += size;
    if (frame[0] & LAST) {
        refusal = fits(object, sdo->done);
        if (refusal == QB_FINE && sdo->announced && sdo->size != sdo->done) {
            refusal = QB_LENGTH_MISMATCH;
        }
        if (refusal == QB_FINE) {
            refusal = store(net, node, sdo->row, sdo->data);
        }
        if (refusal != QB_FINE) {
            return refusal;
        }
        sdo->transfer = QB_NO_TRANSFER;
    }
    confirmation[0] = (uint8_t)(0x20 | sdo->toggle);
    sdo->toggle ^= TOGGLE;
    answer(net, node, confirmation);
    return QB_FINE;
}

static qb_abort give_segment(qb_network *net, int node, const uint8_t *frame)
{
    qb_sdo *sdo = &net->nodes[node].sdo;
    const qb_object *object = qb_row(node, sdo->row);
    const uint8_t *bytes = object->flags & QB_TEXT ? qb_texts[object->start].bytes : sdo->data;
    uint8_t segment[8] = {0};
    uint32_t size = sdo->size - sdo->done;
    int last;
    if (frame[0] >> 5 != 3) {
        return QB_COMMAND_SPECIFIER;
    }
    if ((frame[0] & TOGGLE) != sdo->toggle) {
        return QB_TOGGLE_BIT;
    }
    size = size > SEGMENT ? SEGMENT : size;
    memcpy(segment + 1, bytes + sdo->done, size);
    sdo->done += size;
    last = sdo->done == sdo->size;
    segment[0] = (uint8_t)(sdo->toggle | (SEGMENT - size) << 1 | (uint32_t)last);
    sdo->toggle ^= TOGGLE;
    if (last) {
        sdo->transfer = QB_NO_TRANSFER;
    }
    answer(net, node, segment);
    return QB_FINE;
}

static qb_abort take(qb_network *net, int node, const uint8_t *frame)
{
    qb_sdo *sdo = &net->nodes[node].sdo;
    if (sdo->transfer != QB_NO_TRANSFER && !initiates(frame)) {
        return sdo->transfer == QB_SEGMENTED_DOWNLOAD ? take_segment(net, node, frame) : give_segment(net, node, frame);
    }
    /* A client that begins anew has given up what it did before. */
    sdo->transfer = QB_NO_TRANSFER;
    if (initiates(frame) && frame[0] >> 5 == 1) {
        return initiate_download(net, node, frame);
    }
    if (initiates(frame) && frame[0] >> 5 == 2) {
        return initiate_upload(net, node, frame);
    }
    return QB_COMMAND_SPECIFIER;
}

void qb_sdo_receive(qb_network *net, int node, const qb_frame *frame)
{
    qb_sdo *sdo = &net->nodes[node].sdo;
    const int names = initiates(frame->data) || frame->data[0] >> 5 == 7;
    qb_abort refusal;
    if (frame->length != 8) {
        return;
    }
    if (frame->data[0] == ABORT) {
        sdo->transfer = QB_NO_TRANSFER;
        return;
    }
    refusal = take(net, node, frame->data);
    if (refusal != QB_FINE && sdo->transfer != QB_NO_TRANSFER) {
        give_up(net, node, sdo->index, sdo->subindex, refusal);
    } else if (refusal != QB_FINE) {
        give_up(net, node, names ? index_of(frame->data) : 0, names ? frame->data[3] : 0, refusal);
    }
    if (sdo->transfer != QB_NO_TRANSFER) {
        sdo->deadline = net->now + TIMEOUT;
        if (!qb_timer_runs(net, node, QB_T_SDO)) {
            qb_set_timer(net, node, QB_T_SDO, TIMEOUT);
        }
    }
}

void qb_sdo_timer(qb_network *net, int node)
{
    const qb_sdo *sdo = &net->nodes[node].sdo;
    if (sdo->transfer == QB_NO_TRANSFER) {
        return;
    }
    if (sdo->deadline > net->now) {
        qb_set_timer(net, node, QB_T_SDO, sdo->deadline - net->now);
    } else {
        give_up(net, node, sdo->index, sdo->subindex, QB_TIMED_OUT);
    }
}

void qb_sdo_reset(qb_network *net, int node) { net->nodes[node].sdo.transfer = QB_NO_TRANSFER; }
