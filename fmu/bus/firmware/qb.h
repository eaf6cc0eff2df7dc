/* CANopen devices on one bus, and the hardware under them: what the emulator's firmware does, as plain C99.
 *
 * Everything that changes is in one qb_network, which is plain data without pointers: to save the devices is to copy it.
 * Tables come from qb_tables.h, generated from the EDS files and data sheets of a vehicle. Time is counted in
 * nanoseconds since the start. */
#ifndef QB_H
#define QB_H

#include <stdint.h>

#include "qb_tables.h"

#define QB_NEVER INT64_MAX
#define QB_MILLISECOND 1000000LL
#define QB_ENTRIES 8          /* objects in a PDO */
#define QB_CONSUMERS 8        /* nodes that a heartbeat consumer watches */
#define QB_HISTORY 8          /* errors in 1003h */
#define QB_EMERGENCIES 32     /* messages that may wait for the inhibit time */
#define QB_ERRORS 64          /* errors that are there at a time */
#define QB_FLYING 64          /* frames between the nodes that may wait for the wire */
#define QB_QUEUE 512          /* frames that may wait for the importer */
#define QB_LONGEST 8          /* bytes of an object that can be written */

typedef struct {
    uint32_t id;
    uint8_t length;
    uint8_t data[8];
} qb_frame;

/* One row of an object dictionary. Of a text, `start` is its position in qb_texts. */
typedef struct {
    uint16_t index;
    uint8_t subindex, size, flags;
    int64_t start, minimum, maximum;
} qb_object;

enum { QB_SIGNED = 1, QB_READABLE = 2, QB_WRITABLE = 4, QB_RECEIVABLE = 8, QB_TRANSMITTABLE = 16, QB_OF_NODE = 32, QB_TEXT = 64 };

typedef struct {
    const unsigned char *bytes;
    uint32_t size;
} qb_text;

typedef enum { QB_DRIVE, QB_ENCODER } qb_kind;

typedef struct {
    qb_kind kind;
    const qb_object *objects;
    int count;
} qb_device;

/* A node: its device, its node-ID, and which drive or encoder of the vehicle it is. */
typedef struct {
    int device;
    uint8_t id;
    int place;
} qb_place;

typedef struct {
    double shaft_ratio; /* shaft angle over wheel angle, signed */
    double increments;  /* per rad of the wheel, signed */
} qb_mounting;

typedef struct {
    double scale; /* increments per rad of the angle, signed */
    int64_t zero;
} qb_disc;

extern const qb_text qb_texts[];
extern const qb_device qb_devices[];
extern const qb_place qb_places[QB_NODES];
extern const qb_mounting qb_mountings[QB_DRIVES];
extern const qb_disc qb_discs[QB_ENCODERS_MIN];

/* SDO abort codes of CiA 301, table 22; zero is none. */
typedef uint32_t qb_abort;
enum {
    QB_FINE = 0,
    QB_TOGGLE_BIT = 0x05030000,
    QB_TIMED_OUT = 0x05040000,
    QB_COMMAND_SPECIFIER = 0x05040001,
    QB_UNSUPPORTED_ACCESS = 0x06010000,
    QB_WRITE_ONLY = 0x06010001,
    QB_READ_ONLY = 0x06010002,
    QB_OBJECT_MISSING = 0x06020000,
    QB_NOT_MAPPABLE = 0x06040041,
    QB_PDO_LENGTH_EXCEEDED = 0x06040042,
    QB_PARAMETER_INCOMPATIBLE = 0x06040043,
    QB_LENGTH_MISMATCH = 0x06070010,
    QB_TOO_LONG = 0x06070012,
    QB_TOO_SHORT = 0x06070013,
    QB_SUBINDEX_MISSING = 0x06090011,
    QB_VALUE_RANGE_EXCEEDED = 0x06090030,
    QB_VALUE_TOO_HIGH = 0x06090031,
    QB_VALUE_TOO_LOW = 0x06090032
};
#define QB_DEVICE_STATE 0x08000022u
#define QB_NO_DATA 0x08000024u

typedef enum { QB_INITIALISATION = 0, QB_STOPPED = 4, QB_OPERATIONAL = 5, QB_PRE_OPERATIONAL = 0x7F } qb_nmt;

/* Timers of a node; those due at one instant run in the order in which they were set. */
enum {
    QB_T_HEARTBEAT,
    QB_T_SDO,
    QB_T_SYNC,
    QB_T_EMERGENCY,
    QB_T_TICK,
    QB_T_CONSUMER,
    QB_T_EVENT = QB_T_CONSUMER + QB_CONSUMERS,
    QB_T_INHIBIT = QB_T_EVENT + QB_PDOS,
    QB_T_LOOK = QB_T_INHIBIT + QB_PDOS,
    QB_T_RPDO = QB_T_LOOK + QB_PDOS,
    QB_NODE_TIMERS = QB_T_RPDO + QB_PDOS
};

typedef struct {
    int64_t due;
    uint64_t serial;
} qb_timer;

typedef enum { QB_NO_TRANSFER, QB_SEGMENTED_DOWNLOAD, QB_SEGMENTED_UPLOAD } qb_transfer;

typedef struct {
    qb_transfer transfer;
    uint16_t index;
    uint8_t subindex, toggle;
    int row;
    uint32_t done, size; /* bytes transferred, bytes in all or announced */
    int announced;
    uint8_t data[QB_LONGEST];
    int64_t deadline;
} qb_sdo;

/* A PDO of either direction. */
typedef struct {
    uint32_t cob_id;
    uint8_t type, count;
    int stale, wired;
    uint32_t entries[QB_ENTRIES];
    uint8_t sizes[QB_ENTRIES], length;
    /* transmit */
    int syncs, sync_start, awaits_start, event_pending, enabled, overdue;
    int64_t inhibit_time, event_timer;
    uint8_t sampled[8], sent[8];
    /* receive */
    int waiting, misfit, missing;
    uint8_t received[8];
    int64_t period, deadline;
} qb_pdo;

typedef struct {
    uint16_t code;
    uint16_t information; /* source of an error of the communication, register bits of one of the device */
    int of_device;
} qb_error;

typedef struct {
    qb_error errors[QB_ERRORS];
    int count;
    uint32_t history[QB_HISTORY];
    int known;
    uint8_t waiting[QB_EMERGENCIES][8];
    int first, length, inhibited;
} qb_emergency;

typedef struct {
    uint32_t cob_id, period;
    uint8_t overflow, counter;
    int misfit, running;
    int64_t window, seen_at;
} qb_sync;

typedef struct {
    uint8_t node;
    int64_t period, deadline;
} qb_watched;

/* Set-points as they were written. */
typedef struct {
    uint16_t controlword, written_controlword;
    int16_t target_torque, torque_offset;
} qb_setpoints;

typedef enum { QB_NO_POWER, QB_NO_MODE, QB_CYCLIC_TORQUE, QB_STOP } qb_motion;

typedef struct {
    uint8_t state, reset_level;
    int8_t mode;
    uint16_t error_code, statusword;
    qb_setpoints points;
    qb_motion motion;
    int after_stop; /* transition that follows a stop, zero where none does */
    int reaction;   /* way of stopping of the last fault */
    /* axis */
    int torque_demand, limited, velocity_sign, position_sign;
    double velocity_demand, integral;
    int32_t count;
    int64_t read_at;
    /* stop */
    int stop_kind, by_torque, done;
    double stop_torque, held;
    /* supervision */
    int warns, has_last;
    int32_t last_count;
    int64_t looked_at, last_time, same_since;
} qb_drive;

typedef struct {
    int64_t offset, units, range;
    uint16_t operating;
    int has_last;
    int64_t last_at, last_position, speed;
} qb_encoder;

typedef struct {
    qb_nmt state;
    int64_t values[QB_OBJECTS];
    qb_sdo sdo;
    qb_pdo rpdos[QB_PDOS], tpdos[QB_PDOS];
    qb_emergency emergency;
    qb_sync sync;
    qb_watched watched[QB_CONSUMERS];
    uint8_t missing[128]; /* nodes whose heartbeat is missing */
    uint8_t guarding_toggle;
    qb_drive drive;
    qb_encoder encoder;
    qb_timer timers[QB_NODE_TIMERS];
} qb_node;

/* Power stage, current loop and motor of a drive; torques at the shaft, in the drive's own sign. */
typedef struct {
    int enabled, steps_left, trip;
    double torque, wheel_torque, target, setpoint;
    double thermal_load, energy, at_peak, stalled;
} qb_stage;

typedef struct {
    qb_frame frame;
    int origin;
    qb_timer timer;
} qb_flying;

typedef struct {
    int64_t now, moved;
    uint64_t serial;
    qb_node nodes[QB_NODES];
    qb_stage stages[QB_DRIVES];
    /* what the encoders see: angles and rates of the wheels, steering angles */
    double wheel_angle[QB_DRIVES], wheel_rate[QB_DRIVES], steering_angle[QB_ENCODERS_MIN];
    /* noise of the readings */
    double torque_noise[QB_DRIVES], motor_dither[QB_DRIVES], steering_dither[QB_ENCODERS_MIN];
    qb_flying flying[QB_FLYING];
    int first_flying, in_flight;
    int64_t free_at;
    qb_frame queue[QB_QUEUE];
    int queued;
    uint32_t lost; /* frames that found the queue full */
} qb_network;

/* qb_network.c: for whoever has the bus */
void qb_start(qb_network *net);
void qb_receive(qb_network *net, const qb_frame *frame);
void qb_receive_remote(qb_network *net, uint32_t id);
/* Time up to `instant`; `move` lets the vehicle move to net->now, zero where it cannot. */
int qb_advance(qb_network *net, int64_t instant, int (*move)(void *context, qb_network *net), void *context);
int64_t qb_next_event(const qb_network *net);

/* qb_stage.c: a millisecond of a drive's hardware, for whoever moves the vehicle */
void qb_stage_advance(qb_network *net, int place);

/* qb_dictionary.c: numbers as they are on the bus, little endian */
int64_t qb_unpack(const uint8_t *data, int size, int is_signed);
void qb_pack(uint8_t *data, int size, int64_t value);

#endif
