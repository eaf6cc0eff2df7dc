/* What ISO 15765-2 does with messages and frames: the state of both directions of a socket, and what changes it. */
#ifndef QUASIOMNI_ISOTP_TRANSFER_H
#define QUASIOMNI_ISOTP_TRANSFER_H

#include "sockets.h"

#include <linux/can.h>
#include <linux/can/isotp.h>
#include <pthread.h>
#include <stddef.h>
#include <stdint.h>

#define LONGEST 4095

enum state { IDLE, AWAIT_FLOW, SENDING, AWAIT_CONSECUTIVE };

struct transfer {
    enum state state;
    uint8_t data[LONGEST + 1];
    size_t size, done;
    unsigned number, in_block, block;
    int64_t gap, due, last; /* ns; the gap between frames, when something is to happen, when the last frame came */
};

struct isotp {
    struct can_isotp_options options;
    struct can_isotp_fc_options flow;
    struct can_isotp_ll_options link;
    uint32_t tx_stmin, rx_stmin;
    struct sockaddr_can address;
    struct can_socket bus;
    int bound, program_end, bus_end;
    struct transfer out, in;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t sent;
    unsigned waiting; /* messages that were handed over and are not sent yet */
    int error;        /* of a message that could not be sent */
    int down;         /* the hub is gone, and with it the thread */
};

/* Begins to send the `size` bytes in `out.data`. */
void isotp_begin(struct isotp *socket, size_t size);

/* A frame of the other side. */
void isotp_take(struct isotp *socket, const struct can_frame *frame);

/* Does what is due; how long nothing is [ns], -1 for ever. */
void isotp_act(struct isotp *socket);
int64_t isotp_idle(const struct isotp *socket);

#endif
