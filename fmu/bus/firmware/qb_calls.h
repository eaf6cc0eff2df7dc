/* What the units of the devices call of each other. */
#ifndef QB_CALLS_H
#define QB_CALLS_H

#include "qb.h"

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
double qb_stage_voltage(const qb_stage *stage);
double qb_shaft_velocity(const qb_network *net, int place);
int32_t qb_shaft_position(const qb_network *net, int place);
double qb_shaft_torque(const qb_network *net, int place);

static inline int qb_place_of(int node) { return qb_places[node].place; }
static inline int qb_is_drive(int node) { return qb_devices[qb_places[node].device].kind == QB_DRIVE; }

#endif
