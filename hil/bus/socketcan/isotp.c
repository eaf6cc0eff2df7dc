/*
 * CAN_ISOTP (<linux/can/isotp.h>). The program has one end of a pair of sockets, so that read, select and poll are the
 * system's own; a thread on the other end cuts messages into frames and puts frames together (isotp_transfer.c).
 *
 * Not here: extended addressing, broadcasts without flow control, CAN FD, messages of more than 4095 bytes, errors of
 * the reception as errno (what is incomplete is dropped). A child of fork() has the socket, but not its thread.
 */
#define _GNU_SOURCE
#include "isotp.h"
#include "isotp_transfer.h"
#include "real.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define KNOWN                                                                                                          \
    (CAN_ISOTP_LISTEN_MODE | CAN_ISOTP_TX_PADDING | CAN_ISOTP_RX_PADDING | CAN_ISOTP_CHK_PAD_LEN |                     \
     CAN_ISOTP_CHK_PAD_DATA | CAN_ISOTP_HALF_DUPLEX | CAN_ISOTP_FORCE_TXSTMIN | CAN_ISOTP_FORCE_RXSTMIN |              \
     CAN_ISOTP_WAIT_TX_DONE)

/* The hub is gone: nobody waits for it any more. */
static void *give_up(struct isotp *socket) {
    pthread_mutex_lock(&socket->lock);
    socket->down = 1;
    socket->waiting = 0;
    socket->error = ENETDOWN;
    pthread_cond_broadcast(&socket->sent);
    pthread_mutex_unlock(&socket->lock);
    shutdown(socket->program_end, SHUT_RDWR);
    return NULL;
}

static void *transfer_for_ever(void *given) {
    struct isotp *socket = given;
    struct can_frame frame;
    for (;;) {
        struct pollfd ends[2] = {{.fd = socket->bus_end, .events = POLLIN},
                                 {.fd = socket->out.state == IDLE ? socket->program_end : -1, .events = POLLIN}};
        int64_t left = isotp_idle(socket);
        struct timespec time = {.tv_sec = left / 1000000000LL, .tv_nsec = left % 1000000000LL};
        if (ppoll(ends, 2, left < 0 ? NULL : &time, NULL) < 0) continue;
        if (ends[0].revents) {
            ssize_t received = recv(socket->bus_end, &frame, sizeof frame, MSG_DONTWAIT);
            if (received == 0) return give_up(socket);
            if (received == sizeof frame) isotp_take(socket, &frame);
        }
        if (ends[1].revents) {
            ssize_t size = recv(socket->program_end, socket->out.data, LONGEST, MSG_DONTWAIT);
            if (size == 0) return NULL; /* The program has closed its end. */
            if (size > 0) isotp_begin(socket, (size_t)size);
        }
        isotp_act(socket);
    }
}

int isotp_open(int flags, struct isotp **made) {
    int ends[2];
    struct isotp *socket = calloc(1, sizeof *socket);
    if (!socket || socketpair(AF_UNIX, SOCK_SEQPACKET | flags, 0, ends) < 0) {
        free(socket);
        return -1;
    }
    socket->program_end = ends[1];
    fcntl(ends[1], F_SETFD, FD_CLOEXEC);
    socket->bus_end = -1;
    socket->options.frame_txtime = CAN_ISOTP_DEFAULT_FRAME_TXTIME;
    socket->options.txpad_content = socket->options.rxpad_content = CAN_ISOTP_DEFAULT_PAD_CONTENT;
    socket->link = (struct can_isotp_ll_options){.mtu = CAN_MTU, .tx_dl = CAN_MAX_DLEN};
    pthread_mutex_init(&socket->lock, NULL);
    pthread_cond_init(&socket->sent, NULL);
    *made = socket;
    return ends[0];
}

static int reach_bus(struct isotp *socket, const struct sockaddr_can *address) {
    typedef int (*socket_t)(int, int, int);
    canid_t wanted = address->can_addr.tp.rx_id;
    canid_t all = CAN_EFF_FLAG | CAN_RTR_FLAG | (wanted & CAN_EFF_FLAG ? CAN_EFF_MASK : CAN_SFF_MASK);
    socket->bus_end = REAL(socket_t, "socket")(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    socket->bus.count = 1;
    socket->bus.hello.magic = HELLO_MAGIC;
    socket->bus.hello.filters[0] = (struct can_filter){.can_id = wanted, .can_mask = all};
    return socket->bus_end < 0 ? -1 : socket_join(socket->bus_end, &socket->bus, address);
}

int isotp_bind(struct isotp *socket, const struct sockaddr_can *address, socklen_t length) {
    size_t needed = offsetof(struct sockaddr_can, can_addr) + sizeof address->can_addr.tp;
    errno = length < needed || socket->bound                                  ? EINVAL
            : address->can_addr.tp.rx_id == address->can_addr.tp.tx_id ? EADDRNOTAVAIL
            : !address->can_ifindex                                    ? ENODEV
                                                                       : 0;
    if (errno) return -1;
    if (reach_bus(socket, address) < 0) return -1;
    memcpy(&socket->address, address, needed);
    int error = pthread_create(&socket->thread, NULL, transfer_for_ever, socket);
    socket->bound = !error;
    errno = error;
    return error ? -1 : 0;
}

const struct sockaddr_can *isotp_address(const struct isotp *socket) { return &socket->address; }

/* ---- Options: place and size by their number ---- */

struct option {
    size_t place, size;
};

#define OPTION(member) {offsetof(struct isotp, member), sizeof ((struct isotp *)0)->member}

static const struct option options[] = {
    [CAN_ISOTP_OPTS] = OPTION(options),
    [CAN_ISOTP_RECV_FC] = OPTION(flow),
    [CAN_ISOTP_TX_STMIN] = OPTION(tx_stmin),
    [CAN_ISOTP_RX_STMIN] = OPTION(rx_stmin),
    [CAN_ISOTP_LL_OPTS] = OPTION(link),
};

static const struct option *option(int name) {
    int known = name >= CAN_ISOTP_OPTS && name <= CAN_ISOTP_LL_OPTS;
    return known ? &options[name] : NULL;
}

/* What would be another protocol than this one is refused, not passed over. */
static int is_possible(int name, const void *value) {
    const struct can_isotp_options *wanted = value;
    const struct can_isotp_ll_options *link = value;
    if (name == CAN_ISOTP_OPTS) return !(wanted->flags & ~KNOWN);
    return name != CAN_ISOTP_LL_OPTS || (link->mtu == CAN_MTU && link->tx_dl == CAN_MAX_DLEN);
}

int isotp_set(struct isotp *socket, int name, const void *value, socklen_t size) {
    const struct option *found = option(name);
    if (!found) return ENOPROTOOPT;
    if (socket->bound) return EISCONN;
    if (size != found->size) return EINVAL;
    if (!is_possible(name, value)) return EOPNOTSUPP;
    uint32_t before = socket->options.frame_txtime;
    memcpy((char *)socket + found->place, value, size);
    if (name != CAN_ISOTP_OPTS) return 0;
    if (socket->options.frame_txtime == 0) socket->options.frame_txtime = before; /* 0: as it was. */
    if (socket->options.frame_txtime == CAN_ISOTP_FRAME_TXTIME_ZERO) socket->options.frame_txtime = 0;
    return 0;
}

int isotp_get(const struct isotp *socket, int name, void *value, socklen_t *size) {
    const struct option *found = option(name);
    if (!found) return ENOPROTOOPT;
    if (*size > found->size) *size = found->size;
    memcpy(value, (const char *)socket + found->place, *size);
    return 0;
}

/* ---- Messages of the program ---- */

static int take_error(struct isotp *socket) {
    int error = socket->error;
    socket->error = 0;
    return error;
}

/* Counts a message as handed over; the error of one before it, where there was one. */
static int announce(struct isotp *socket) {
    pthread_mutex_lock(&socket->lock);
    int error = socket->down ? ENETDOWN : take_error(socket);
    if (!error) socket->waiting++;
    pthread_mutex_unlock(&socket->lock);
    return error;
}

/* Waits until it is sent, or takes it back; the error of that. */
static int settle(struct isotp *socket, int handed_over) {
    pthread_mutex_lock(&socket->lock);
    if (!handed_over) socket->waiting--;
    while (handed_over && socket->options.flags & CAN_ISOTP_WAIT_TX_DONE && socket->waiting)
        pthread_cond_wait(&socket->sent, &socket->lock);
    int error = handed_over && socket->options.flags & CAN_ISOTP_WAIT_TX_DONE ? take_error(socket) : 0;
    pthread_mutex_unlock(&socket->lock);
    return error;
}

ssize_t isotp_write(int fd, struct isotp *socket, const void *message, size_t size, int flags) {
    typedef ssize_t (*send_t)(int, const void *, size_t, int);
    int error = !socket->bound ? EADDRNOTAVAIL : size == 0 ? EINVAL : size > LONGEST ? EMSGSIZE : announce(socket);
    if (!error) {
        ssize_t sent = REAL(send_t, "send")(fd, message, size, flags | MSG_NOSIGNAL);
        error = sent < 0 ? errno : 0;
        int later = settle(socket, sent >= 0);
        error = error ? error : later;
    }
    errno = error;
    return error ? -1 : (ssize_t)size;
}

void isotp_close(int fd, struct isotp *socket) {
    typedef int (*close_t)(int);
    close_t close_really = REAL(close_t, "close");
    shutdown(fd, SHUT_WR);
    if (socket->bound) pthread_join(socket->thread, NULL);
    close_really(socket->program_end);
    if (socket->bus_end >= 0) close_really(socket->bus_end);
    free(socket);
}
