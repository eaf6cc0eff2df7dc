/*
 * ISO 15765-2 on classical frames: single frame, first and consecutive frames, flow control with block size, separation
 * time, wait and overflow, padding.
 */
#define _GNU_SOURCE
#include "isotp_transfer.h"
#include "real.h"

#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#define TIMEOUT 1000000000LL /* N_Bs, N_Cr: for a flow control and for a consecutive frame, in ns */

enum kind { SINGLE, FIRST, CONSECUTIVE, FLOW };
enum flow { GO_ON, WAIT, OVERFLOW };

static int64_t now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * 1000000000LL + time.tv_nsec;
}

static void send_frame(struct isotp *socket, const uint8_t *data, size_t size) {
    struct can_frame frame = {.can_id = socket->address.can_addr.tp.tx_id, .can_dlc = (uint8_t)size};
    memcpy(frame.data, data, size);
    if (socket->options.flags & CAN_ISOTP_TX_PADDING) {
        memset(frame.data + size, socket->options.txpad_content, CAN_MAX_DLEN - size);
        frame.can_dlc = CAN_MAX_DLEN;
    }
    (void)!transmit_packet(socket->bus_end, &frame, sizeof frame);
}

/* ---- Sending ---- */

static void end_sending(struct isotp *socket, int error) {
    socket->out.state = IDLE;
    pthread_mutex_lock(&socket->lock);
    socket->waiting--;
    if (error) socket->error = error;
    pthread_cond_broadcast(&socket->sent);
    pthread_mutex_unlock(&socket->lock);
}

static void await_flow(struct transfer *out) {
    out->state = AWAIT_FLOW;
    out->due = now() + TIMEOUT;
}

/* A message of the program: as a single frame, or the first one of many. */
void isotp_begin(struct isotp *socket, size_t size) {
    struct transfer *out = &socket->out;
    uint8_t frame[CAN_MAX_DLEN] = {(uint8_t)size};
    out->size = size;
    if (size < CAN_MAX_DLEN) {
        memcpy(frame + 1, out->data, size);
        send_frame(socket, frame, size + 1);
        end_sending(socket, 0);
        return;
    }
    frame[0] = (uint8_t)(FIRST << 4 | size >> 8);
    frame[1] = (uint8_t)size;
    memcpy(frame + 2, out->data, 6);
    out->done = 6;
    out->number = 1;
    await_flow(out);
    send_frame(socket, frame, sizeof frame);
}

static void send_consecutive(struct isotp *socket) {
    struct transfer *out = &socket->out;
    uint8_t frame[CAN_MAX_DLEN] = {(uint8_t)(CONSECUTIVE << 4 | out->number)};
    size_t part = out->size - out->done < 7 ? out->size - out->done : 7;
    memcpy(frame + 1, out->data + out->done, part);
    out->done += part;
    out->number = (out->number + 1) % 16;
    int block_ends = out->block && ++out->in_block == out->block;
    if (block_ends && out->done < out->size) await_flow(out);
    else out->due = now() + out->gap;
    send_frame(socket, frame, part + 1);
    if (out->done == out->size) end_sending(socket, 0);
}

/* Separation time: 0 to 127 ms, 100 to 900 us; what is reserved counts as the longest (ISO 15765-2, 9.6.5.4). */
static int64_t separation(uint8_t code) {
    if (code <= 0x7F) return code * 1000000LL;
    return code >= 0xF1 && code <= 0xF9 ? (code - 0xF0) * 100000LL : 127000000LL;
}

static void take_flow(struct isotp *socket, const struct can_frame *frame) {
    struct transfer *out = &socket->out;
    if (out->state != AWAIT_FLOW || frame->can_dlc < 3) return;
    int forced = socket->options.flags & CAN_ISOTP_FORCE_TXSTMIN;
    switch (frame->data[0] & 0x0F) {
    case GO_ON:
        out->block = frame->data[1];
        out->in_block = 0;
        out->gap = (forced ? socket->tx_stmin : separation(frame->data[2])) + socket->options.frame_txtime;
        out->due = now() + out->gap;
        out->state = SENDING;
        return;
    case WAIT: await_flow(out); return;
    case OVERFLOW: end_sending(socket, EMSGSIZE); return;
    default: end_sending(socket, EBADMSG);
    }
}

/* ---- Receiving ---- */

static void deliver(struct isotp *socket, const uint8_t *data, size_t size) {
    typedef ssize_t (*send_t)(int, const void *, size_t, int);
    socket->in.state = IDLE;
    (void)!REAL(send_t, "send")(socket->program_end, data, size, MSG_NOSIGNAL | MSG_DONTWAIT);
}

static void send_flow(struct isotp *socket, enum flow status) {
    uint8_t frame[3] = {(uint8_t)(FLOW << 4 | status), socket->flow.bs, socket->flow.stmin};
    if (!(socket->options.flags & CAN_ISOTP_LISTEN_MODE)) send_frame(socket, frame, sizeof frame);
}

/* Whether what follows `used` bytes is what the options ask for (isotp_check_pad of the kernel). */
static int is_padded(const struct isotp *socket, const struct can_frame *frame, size_t used) {
    unsigned flags = socket->options.flags, checked = flags & (CAN_ISOTP_CHK_PAD_LEN | CAN_ISOTP_CHK_PAD_DATA);
    if (!(flags & CAN_ISOTP_RX_PADDING)) return !checked || frame->can_dlc == used;
    if (flags & CAN_ISOTP_CHK_PAD_LEN && frame->can_dlc != CAN_MAX_DLEN) return 0;
    for (size_t k = used; flags & CAN_ISOTP_CHK_PAD_DATA && k < frame->can_dlc; k++)
        if (frame->data[k] != socket->options.rxpad_content) return 0;
    return 1;
}

static void take_single(struct isotp *socket, const struct can_frame *frame) {
    size_t size = frame->data[0] & 0x0F;
    if (size == 0 || size + 1 > frame->can_dlc || !is_padded(socket, frame, size + 1)) return;
    deliver(socket, frame->data + 1, size);
}

static void take_first(struct isotp *socket, const struct can_frame *frame) {
    struct transfer *in = &socket->in;
    in->state = IDLE;
    in->size = (size_t)(frame->data[0] & 0x0F) << 8 | frame->data[1];
    if (frame->can_dlc != CAN_MAX_DLEN || (in->size > 0 && in->size < CAN_MAX_DLEN)) return;
    if (in->size == 0) { /* The length follows in four bytes: longer than what is taken here. */
        send_flow(socket, OVERFLOW);
        return;
    }
    memcpy(in->data, frame->data + 2, 6);
    in->done = 6;
    in->number = 1;
    in->in_block = 0;
    in->last = 0;
    in->state = AWAIT_CONSECUTIVE;
    in->due = now() + TIMEOUT;
    send_flow(socket, GO_ON);
}

static void take_consecutive(struct isotp *socket, const struct can_frame *frame) {
    struct transfer *in = &socket->in;
    int64_t instant = now();
    if (in->state != AWAIT_CONSECUTIVE) return;
    if (socket->options.flags & CAN_ISOTP_FORCE_RXSTMIN && instant - in->last < socket->rx_stmin) return;
    if ((frame->data[0] & 0x0F) != in->number) {
        in->state = IDLE;
        return;
    }
    size_t left = in->size - in->done, part = (size_t)frame->can_dlc - 1 < left ? (size_t)frame->can_dlc - 1 : left;
    memcpy(in->data + in->done, frame->data + 1, part);
    in->done += part;
    in->number = (in->number + 1) % 16;
    in->last = instant;
    in->due = instant + TIMEOUT;
    if (in->done == in->size) {
        in->state = IDLE;
        if (is_padded(socket, frame, part + 1)) deliver(socket, in->data, in->size);
    } else if (socket->flow.bs && ++in->in_block == socket->flow.bs) {
        in->in_block = 0;
        send_flow(socket, GO_ON);
    }
}

void isotp_take(struct isotp *socket, const struct can_frame *frame) {
    if (frame->can_dlc == 0) return;
    switch (frame->data[0] >> 4) {
    case SINGLE: take_single(socket, frame); break;
    case FIRST: take_first(socket, frame); break;
    case CONSECUTIVE: take_consecutive(socket, frame); break;
    case FLOW: take_flow(socket, frame); break;
    default: break;
    }
}

/* ---- Time ---- */

void isotp_act(struct isotp *socket) {
    int64_t instant = now();
    if (socket->out.state == SENDING && instant >= socket->out.due) send_consecutive(socket);
    if (socket->out.state == AWAIT_FLOW && instant >= socket->out.due) end_sending(socket, ECOMM);
    if (socket->in.state == AWAIT_CONSECUTIVE && instant >= socket->in.due) socket->in.state = IDLE;
}

int64_t isotp_idle(const struct isotp *socket) {
    int64_t due = INT64_MAX, instant = now();
    if (socket->out.state != IDLE) due = socket->out.due;
    if (socket->in.state != IDLE && socket->in.due < due) due = socket->in.due;
    return due == INT64_MAX ? -1 : due > instant ? due - instant : 0;
}
