/*
 * The sending half of CAN_BCM (<linux/can/bcm.h>): TX_SETUP, TX_SEND, TX_READ, TX_DELETE. A thread of the program
 * sends what is due; python-can's send_periodic on `socketcan` needs it, and with it canopen's SYNC and heartbeat.
 *
 * Not here: receive filters (RX_SETUP), CAN FD, notification of expired counts.
 */
#define _GNU_SOURCE
#include "broadcast.h"
#include "sockets.h"

#include <errno.h>
#include <linux/can.h>
#include <linux/can/bcm.h>
#include <pthread.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#define TASKS 256
#define FRAMES 64

struct task {
    int used, fd;
    canid_t can_id;
    unsigned nframes, next, left;
    int64_t first_period, period, due; /* ns; due 0: not running */
    struct can_frame frames[FRAMES];
};

static struct task tasks[TASKS];
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t changed;
static int running;

static int64_t now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * 1000000000LL + time.tv_nsec;
}

static int64_t nanoseconds(struct bcm_timeval time) { return time.tv_sec * 1000000000LL + time.tv_usec * 1000LL; }

static struct task *find(int fd, canid_t can_id) {
    for (int k = 0; k < TASKS; k++)
        if (tasks[k].used && tasks[k].fd == fd && tasks[k].can_id == can_id) return &tasks[k];
    return NULL;
}

static struct task *add(int fd, canid_t can_id) {
    for (int k = 0; k < TASKS; k++)
        if (!tasks[k].used) {
            memset(&tasks[k], 0, sizeof tasks[k]);
            tasks[k].used = 1;
            tasks[k].fd = fd;
            tasks[k].can_id = can_id;
            return &tasks[k];
        }
    return NULL;
}

static void transmit(struct task *task) {
    (void)!transmit_packet(task->fd, &task->frames[task->next], sizeof(struct can_frame));
    task->next = (task->next + 1) % task->nframes;
}

/* The next instant after one that has come: `left` frames at the first period, then at the second. */
static void schedule(struct task *task, int64_t from) {
    int64_t period = task->left > 0 && task->first_period > 0 ? task->first_period : task->period;
    task->due = period > 0 ? from + period : 0;
}

static void send_due(int64_t instant) {
    for (int k = 0; k < TASKS; k++) {
        struct task *task = &tasks[k];
        if (!task->used || !task->due || task->due > instant) continue;
        transmit(task);
        if (task->left > 0) task->left--;
        schedule(task, task->due);
        if (task->due && task->due < instant) schedule(task, instant); /* The machine slept: no burst afterwards. */
    }
}

static int64_t next_due(void) {
    int64_t earliest = 0;
    for (int k = 0; k < TASKS; k++)
        if (tasks[k].used && tasks[k].due && (!earliest || tasks[k].due < earliest)) earliest = tasks[k].due;
    return earliest;
}

static void *send_for_ever(void *unused) {
    (void)unused;
    pthread_mutex_lock(&lock);
    for (;;) {
        int64_t due = next_due();
        if (!due) {
            pthread_cond_wait(&changed, &lock);
        } else {
            struct timespec until = {.tv_sec = due / 1000000000LL, .tv_nsec = due % 1000000000LL};
            pthread_cond_timedwait(&changed, &lock, &until);
            send_due(now());
        }
    }
    return NULL;
}

static int start_thread(void) {
    pthread_t thread;
    pthread_condattr_t attributes;
    if (running) return 0;
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&changed, &attributes);
    int error = pthread_create(&thread, NULL, send_for_ever, NULL);
    running = !error;
    return error;
}

static int set_up(int fd, const struct bcm_msg_head *head, const struct can_frame *frames) {
    struct task *task = find(fd, head->can_id);
    if (head->nframes < 1 || head->nframes > FRAMES) return EINVAL;
    for (unsigned k = 0; k < head->nframes; k++)
        if (frames[k].can_dlc > CAN_MAX_DLEN) return EINVAL;
    if (!task) task = add(fd, head->can_id);
    if (!task) return ENOMEM;
    task->nframes = head->nframes;
    memcpy(task->frames, frames, head->nframes * sizeof *frames);
    for (unsigned k = 0; k < head->nframes && head->flags & TX_CP_CAN_ID; k++) task->frames[k].can_id = head->can_id;
    if (task->next >= task->nframes || head->flags & TX_RESET_MULTI_IDX) task->next = 0;
    if (head->flags & SETTIMER) {
        task->left = head->count;
        task->first_period = nanoseconds(head->ival1);
        task->period = nanoseconds(head->ival2);
        task->due = 0;
    }
    if (head->flags & TX_ANNOUNCE) {
        transmit(task);
        if (task->left > 0) task->left--;
    }
    if (head->flags & STARTTIMER) {
        schedule(task, now());
        int error = start_thread();
        if (error) return error;
        pthread_cond_signal(&changed);
    }
    return 0;
}

static int carry_out(int fd, const struct bcm_msg_head *head, const struct can_frame *frames, size_t count) {
    struct task *task = find(fd, head->can_id);
    switch (head->opcode) {
    case TX_SETUP: return head->nframes == count ? set_up(fd, head, frames) : EINVAL;
    case TX_SEND:
        if (head->nframes != 1 || count != 1 || frames->can_dlc > CAN_MAX_DLEN) return EINVAL;
        return transmit_packet(fd, frames, sizeof *frames) < 0 ? errno : 0;
    case TX_READ: return task ? 0 : EINVAL;
    case TX_DELETE:
        if (!task) return EINVAL;
        task->used = 0;
        return 0;
    default: return EOPNOTSUPP;
    }
}

ssize_t broadcast_command(int fd, const void *message, size_t size) {
    const struct bcm_msg_head *head = message;
    size_t whole = sizeof *head;
    if (size < whole || (size - whole) % sizeof(struct can_frame) || head->flags & CAN_FD_FRAME) {
        errno = EINVAL;
        return -1;
    }
    pthread_mutex_lock(&lock);
    const struct can_frame *frames = (const struct can_frame *)((const char *)message + whole);
    int error = carry_out(fd, head, frames, (size - whole) / sizeof *frames);
    pthread_mutex_unlock(&lock);
    if (error) {
        errno = error;
        return -1;
    }
    return (ssize_t)size;
}

void broadcast_close(int fd) {
    pthread_mutex_lock(&lock);
    for (int k = 0; k < TASKS; k++)
        if (tasks[k].fd == fd) tasks[k].used = 0;
    pthread_mutex_unlock(&lock);
}

void broadcast_move(int fd, int other) {
    pthread_mutex_lock(&lock);
    for (int k = 0; k < TASKS; k++)
        if (tasks[k].fd == fd) tasks[k].fd = other;
    pthread_mutex_unlock(&lock);
}
