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

/* qb_network.c: for the nodes */
void qb_send(qb_network *net, int node, uint32_t id, const uint8_t *data, int length);
void qb_produce_sync(qb_network *net, int node, uint32_t id, const uint8_t *data, int length);
void qb_set_timer(qb_network *net, int node, int timer, int64_t delay);
void qb_stop_timer(qb_network *net, int node, int timer);
int qb_timer_runs(const qb_network *net, int node, int timer);

/* qb_dictionary.c */
int qb_find(int node, uint16_t index, uint8_t subindex, qb_abort *missing);
const qb_object *qb_row(int node, int row);
void qb_restore(qb_network *net, int node, uint16_t last);
int64_t qb_value(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t otherwise);
qb_abort qb_read(qb_network *net, int node, int row, int64_t *value);
qb_abort qb_check(int node, int row, int64_t value);
qb_abort qb_write(qb_network *net, int node, int row, int64_t value);
void qb_write_by_pdo(qb_network *net, int node, int row, int64_t value);
int64_t qb_unpack(const uint8_t *data, int size, int is_signed);
void qb_pack(uint8_t *data, int size, int64_t value);

/* qb_sdo.c */
void qb_sdo_receive(qb_network *net, int node, const qb_frame *frame);
void qb_sdo_timer(qb_network *net, int node);
void qb_sdo_reset(qb_network *net, int node);

/* qb_pdo.c: parameters; qb_rpdo.c, qb_tpdo.c */
void qb_pdo_load(qb_network *net, int node);
void qb_pdo_wire(qb_network *net, int node, int afresh);
qb_abort qb_pdo_write(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t value);
int qb_pdo_exists(int node, uint16_t base, int number);
int qb_pdo_valid(const qb_pdo *pdo);
void qb_rpdo_compile(qb_pdo *pdo);
void qb_rpdo_receive(qb_network *net, int node, int number, const qb_frame *frame);
void qb_rpdo_sync(qb_network *net, int node, int number);
void qb_rpdo_timer(qb_network *net, int node, int number);
void qb_tpdo_compile(qb_network *net, int node, int number);
void qb_tpdo_data(qb_network *net, int node, int number, uint8_t *data);
int qb_tpdo_due(qb_network *net, int node, int number);
void qb_tpdo_sample(qb_network *net, int node, int number);
void qb_tpdo_remote(qb_network *net, int node, int number);
void qb_tpdo_enable(qb_network *net, int node, int number, int enabled);
void qb_tpdo_event(qb_network *net, int node);
void qb_tpdo_timer(qb_network *net, int node, int timer);

/* qb_emergency.c */
void qb_emergency_reset(qb_network *net, int node, int application);
uint8_t qb_error_register(const qb_network *net, int node);
void qb_report(qb_network *net, int node, uint16_t code, uint8_t bits);
void qb_clear_errors(qb_network *net, int node);
void qb_report_communication(qb_network *net, int node, uint16_t code, uint16_t information);
/* Of one source, or of all with QB_ANY_SOURCE. */
#define QB_ANY_SOURCE (-1)
void qb_end_communication(qb_network *net, int node, uint16_t code, int information);
void qb_emergency_timer(qb_network *net, int node);
uint32_t qb_emergency_cob_id(qb_network *net, int node);

/* qb_node.c */
void qb_nmt_reset(qb_network *net, int node, int application);
void qb_nmt_receive(qb_network *net, int node, const qb_frame *frame);
void qb_guarding_answer(qb_network *net, int node);
int qb_talks(const qb_network *net, int node);
qb_abort qb_node_write(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t value);
int qb_consumes(const qb_network *net, int node, uint32_t id);
void qb_heartbeat_receive(qb_network *net, int node, uint32_t id);
void qb_node_timer(qb_network *net, int node, int timer);
qb_abort qb_check_cob_id(uint32_t value);

/* qb_sync.c */
void qb_reset_sync(qb_network *net, int node);
void qb_run_sync(qb_network *net, int node, int running);
void qb_send_sync(qb_network *net, int node);
qb_abort qb_write_sync(qb_network *net, int node, uint16_t index, uint32_t value);
int qb_accepts_sync(qb_network *net, int node, const qb_frame *frame);
/* Inputs are taken and set-points given at a SYNC; then what event-driven PDOs there are. */
void qb_latch(qb_network *net, int node);
void qb_notify(qb_network *net, int node);

/* qb_drive.c, qb_axis.c: CiA 402 */
void qb_drive_reset(qb_network *net, int node);
void qb_drive_nmt_changed(qb_network *net, int node);
void qb_drive_applied(qb_network *net, int node);
void qb_drive_follow(qb_network *net, int node);
void qb_drive_setpoints_missing(qb_network *net, int node);
void qb_drive_sample(qb_network *net, int node);
void qb_drive_connection_lost(qb_network *net, int node);
void qb_drive_tick(qb_network *net, int node);
void qb_drive_tripped(qb_network *net, int place, int trip);
void qb_drive_select(qb_network *net, int node, int8_t mode);
int qb_drive_moves(const qb_network *net, int node);
void qb_axis_reset(qb_network *net, int node);
void qb_axis_release(qb_network *net, int node);
void qb_axis_start(qb_network *net, int node);
int qb_axis_take(qb_network *net, int node);
void qb_axis_tick(qb_network *net, int node);
int qb_axis_passes(qb_network *net, int node);
int32_t qb_axis_position(qb_network *net, int node);
int32_t qb_axis_shown_position(qb_network *net, int node);
int32_t qb_wrap(int64_t count);
double qb_increments(const qb_network *net, int node);

/* qb_objects.c: the objects of the device profiles */
int qb_profile_read(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t *value);
qb_abort qb_profile_write(qb_network *net, int node, uint16_t index, int64_t value);
int qb_profile_write_by_pdo(qb_network *net, int node, uint16_t index, int64_t value);
void qb_profile_changed(qb_network *net, int node, uint16_t index);

/* qb_encoder.c: CiA 406 */
void qb_encoder_reset(qb_network *net, int node);
void qb_encoder_sample(qb_network *net, int node);
int qb_encoder_read(qb_network *net, int node, uint16_t index, uint8_t subindex, int64_t *value);
qb_abort qb_encoder_write(qb_network *net, int node, uint16_t index, int64_t value);

/* qb_stage.c: hardware of the drives */
enum { QB_OVER_CURRENT = 1, QB_OVER_TEMPERATURE, QB_OVER_VOLTAGE, QB_BLOCKED, QB_ENCODER_TRIP };
void qb_stage_start(qb_network *net);
void qb_stage_enable(qb_stage *stage);
void qb_stage_disable(qb_stage *stage);
void qb_stage_command(qb_stage *stage, double torque, int at_once);
void qb_stage_advance(qb_network *net, int place);
double qb_stage_voltage(const qb_stage *stage);
double qb_shaft_velocity(const qb_network *net, int place);
int32_t qb_shaft_position(const qb_network *net, int place);
double qb_shaft_torque(const qb_network *net, int place);

static inline int qb_place_of(int node) { return qb_places[node].place; }
static inline int qb_is_drive(int node) { return qb_devices[qb_places[node].device].kind == QB_DRIVE; }

#endif
