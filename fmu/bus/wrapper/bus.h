/* One instance: devices on a bus (qb.h) over a plant (instance.h), and the bus terminal of FMI-LS-BUS between them and
 * the importer. */
#ifndef QB_BUS_H
#define QB_BUS_H

#include "instance.h"
#include "qb.h"

#define QB_BYTES 16384 /* of Rx_Data and Tx_Data at a time: 682 frames of eight bytes */

/* Value references beside those of the plant. */
enum {
    QB_RX_DATA = QO_VARIABLES,
    QB_RX_CLOCK,
    QB_TX_DATA,
    QB_TX_CLOCK,
    QB_TORQUE_NOISE,
    QB_ENCODER_NOISE,
    QB_SEED,
    QB_FRAMES_LOST,
    QB_ALL_VARIABLES
};

/* References of what the drives put into the plant, and of what their encoders see of it. */
extern const unsigned qb_torques[QB_DRIVES];
extern const unsigned qb_wheel_angles[QB_DRIVES];
extern const unsigned qb_wheel_rates[QB_DRIVES];
extern const unsigned qb_steering_angles[QB_ENCODERS_MIN];
#define QB_STEERINGS (QB_HAS_STEERING ? QB_ENCODERS_MIN : 0)

typedef struct {
    double torque, encoder; /* rms, of rated torque and in increments */
    int32_t seed;
    uint64_t state;
} qb_noise;

/* Everything that a saved state holds beside the plant; no pointer in it. */
typedef struct {
    qb_network net;
    qb_noise noise;
    double start_time;
    int64_t announced; /* instant that the importer knows Tx_Clock to tick at */
    int configured;    /* the bus simulation knows bit rate and buffering */
    int rx_ticks, tx_ticks;
    size_t rx_size, tx_size;
    uint8_t rx[QB_BYTES], tx[QB_BYTES];
} qb_state;

typedef struct {
    qo_instance plant; /* first: every function of the plant takes this instance */
    qb_state now;
} qb_bus;

/* qb_plant.c */
void qb_plant_reset(qb_bus *me);
void qb_plant_start(qb_bus *me);
/* For qb_advance: the plant follows the devices' time; zero where it cannot, which has been told. */
int qb_plant_move(void *bus, qb_network *net);
/* Values that the drives set are no inputs. */
int qb_is_driven(unsigned reference);

/* ls_bus.c: operations of FMI-LS-BUS for CAN */
void qb_take_operations(qb_bus *me);
void qb_give_operations(qb_bus *me);

/* Whether Tx_Clock has a reason to tick now. */
int qb_has_news(const qb_bus *me);

/* Time of Tx_Clock's next tick, QB_NEVER where nothing is to come. */
int64_t qb_next_tick(const qb_bus *me);

#endif
