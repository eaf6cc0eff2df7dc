/* Descriptors that come and go: a duplicate is the same CAN socket, with its options, filters and broadcasts. */
#define _GNU_SOURCE
#include "broadcast.h"
#include "isotp.h"
#include "real.h"
#include "sockets.h"

#include <fcntl.h>
#include <stdarg.h>
#include <unistd.h>

/* Before a descriptor is closed. */
static void forget(int fd) {
    struct can_socket *entry = socket_remembered(fd) ? socket_of(fd) : NULL;
    if (!entry) return;
    int broadcast = entry->broadcast;
    struct isotp *isotp = entry->isotp;
    int other = socket_release(fd);
    if (broadcast && other >= 0) broadcast_move(fd, other);
    if (broadcast && other < 0) broadcast_close(fd);
    if (isotp && other < 0) isotp_close(fd, isotp);
}

static int shared(int from, int to) {
    if (to >= 0 && to != from && socket_remembered(from) && socket_of(from)) {
        if (socket_remembered(to)) socket_release(to); /* Closed past us, and given out again. */
        socket_share(from, to);
    }
    return to;
}

int close(int fd) {
    typedef int (*close_t)(int);
    forget(fd);
    return REAL(close_t, "close")(fd);
}

int dup(int fd) {
    typedef int (*dup_t)(int);
    return shared(fd, REAL(dup_t, "dup")(fd));
}

int dup2(int fd, int wanted) {
    typedef int (*dup2_t)(int, int);
    if (fd != wanted) forget(wanted);
    return shared(fd, REAL(dup2_t, "dup2")(fd, wanted));
}

int dup3(int fd, int wanted, int flags) {
    typedef int (*dup3_t)(int, int, int);
    if (fd != wanted) forget(wanted);
    return shared(fd, REAL(dup3_t, "dup3")(fd, wanted, flags));
}

#define FCNTL(name)                                                                                                    \
    int name(int fd, int command, ...) {                                                                               \
        typedef int (*fcntl_t)(int, int, void *);                                                                      \
        va_list arguments;                                                                                             \
        va_start(arguments, command);                                                                                  \
        void *argument = va_arg(arguments, void *);                                                                    \
        va_end(arguments);                                                                                             \
        int answer = REAL(fcntl_t, #name)(fd, command, argument);                                                      \
        return command == F_DUPFD || command == F_DUPFD_CLOEXEC ? shared(fd, answer) : answer;                         \
    }
FCNTL(fcntl)
FCNTL(fcntl64)
