/* Random frames and random bytes into the bus terminal of an FMU, while its time goes on.
 *
 * Compiled with the sources of the FMU under the address and undefined-behaviour sanitizers. Ends with 1 and a line that
 * says what and how to repeat it, where
 *   - a call answers with an error,
 *   - Tx_Data is no row of operations that the standard knows, or a frame in it is none of CAN 2.0,
 *   - bytes that are no operation are not answered by a format error,
 *   - an output is not finite,
 *   - a restored state does not send what it has sent before.
 *
 * Usage: fuzz_bus SEED FRAMES */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

#include "bus.h"

#define BATCH 24

static uint64_t seed, random_state;
static unsigned long frames_given, frames_sent, format_errors, emergencies, malformed;
static double now;

static uint64_t random_bits(void)
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 7;
    random_state ^= random_state << 17;
    return random_state * 2685821657736338717ULL;
}

static unsigned below(unsigned n) { return (unsigned)((random_bits() >> 32) % n); }

static void fail(const char *what)
{
    printf("%s (seed %llu, after %lu frames, at %g s)\n", what, (unsigned long long)seed, frames_given, now);
    exit(1);
}

static void hear(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message)
{
    (void)environment, (void)category;
    if (status == fmi3Error) {
        fail(message);
    }
}

static void must(fmi3Status status, const char *what)
{
    if (status != fmi3OK) {
        fail(what);
    }
}

static size_t put(uint8_t *place, uint32_t code, uint32_t size)
{
    memcpy(place, &code, 4);
    memcpy(place + 4, &size, 4);
    return size;
}

/* Identifiers that devices listen to, by their services; now and then any. */
static uint32_t identifier(void)
{
    static const uint32_t bases[] = {0x000, 0x080, 0x200, 0x300, 0x600, 0x600, 0x600, 0x600, 0x700, 0x180};
    const uint32_t base = bases[below(10)];
    if (below(20) == 0) {
        return below(0x800);
    }
    return base == 0 ? 0 : base == 0x080 ? 0x080 : base + 1 + below(6);
}

/* Bytes that are likely to mean something: objects that there are, commands of SDO and NMT. */
static void fill(uint32_t id, uint8_t *data)
{
    static const uint8_t requests[] = {0x40, 0x2F, 0x2B, 0x23, 0x22, 0x21, 0x60, 0x70, 0x00, 0x01, 0x0D, 0x80, 0xA0, 0xC0};
    static const uint8_t commands[] = {0x01, 0x01, 0x01, 0x02, 0x80, 0x81, 0x82};
    const qb_device *device = &qb_devices[below(QB_HAS_STEERING + 1)];
    const qb_object *object = &device->objects[below((unsigned)device->count)];
    unsigned k;
    for (k = 0; k < 8; k++) {
        data[k] = (uint8_t)below(below(3) ? 256 : 4);
    }
    if (id >= 0x601 && id <= 0x67F && below(10)) {
        data[0] = requests[below(sizeof requests)];
        data[1] = (uint8_t)object->index;
        data[2] = (uint8_t)(object->index >> 8);
        data[3] = object->subindex;
    } else if (id == 0) {
        data[0] = below(8) ? commands[below(sizeof commands)] : data[0];
        data[1] = (uint8_t)below(8);
    } else if (id >= 0x201 && id <= 0x27F && below(4)) {
        static const uint8_t words[] = {0x06, 0x07, 0x0F, 0x0F, 0x0F, 0x00, 0x02, 0x80};
        data[0] = words[below(sizeof words)];
        data[1] = 0;
    }
}

static uint8_t usual_length(uint32_t id)
{
    return id == 0 ? 2 : id == 0x080 ? 0 : id >= 0x201 && id <= 0x27F ? 4 : id >= 0x700 ? 1 : 8;
}

static size_t give_frame(uint8_t *place)
{
    const uint32_t id = identifier();
    const uint16_t length = below(12) ? usual_length(id) : (uint16_t)below(9);
    memset(place, 0, 16);
    memcpy(place + 8, &id, 4);
    place[12] = below(200) == 0;
    place[13] = below(50) == 0;
    memcpy(place + 14, &length, 2);
    fill(id, place + 16);
    frames_given++;
    return put(place, 0x10, 16u + length);
}

/* What an importer must not send: unknown operations, lengths that do not fit, bytes of nowhere. */
static size_t give_nonsense(uint8_t *place)
{
    size_t k, size = 1 + below(40);
    for (k = 0; k < size; k++) {
        place[k] = (uint8_t)random_bits();
    }
    if (below(2) && size >= 8) {
        put(place, below(0x50), (uint32_t)size);
    }
    malformed++;
    return size;
}

static void look(const uint8_t *bytes, size_t size)
{
    while (size > 0) {
        uint32_t code, length;
        uint16_t data;
        if (size < 8) {
            fail("bytes are left over in Tx_Data");
        }
        memcpy(&code, bytes, 4);
        memcpy(&length, bytes + 4, 4);
        if (length < 8 || length > size) {
            fail("an operation in Tx_Data has a wrong length");
        }
        if (code == 0x10) {
            memcpy(&data, bytes + 14, 2);
            if (length != 16u + data || data > 8 || bytes[12] != 0 || bytes[13] != 0 || bytes[10] || bytes[11] || bytes[9] > 7) {
                fail("a frame in Tx_Data is none of CAN 2.0 with 11 bits");
            }
            frames_sent++;
            emergencies += bytes[9] == 0 && bytes[8] > 0x80;
        } else if (code == 0x01) {
            format_errors++;
        } else if (code != 0x40) {
            fail("an unknown operation in Tx_Data");
        }
        bytes += length;
        size -= length;
    }
}

static double interval(fmi3Instance instance)
{
    const fmi3ValueReference clock = QB_TX_CLOCK;
    fmi3IntervalQualifier qualifier;
    double seconds;
    must(fmi3GetIntervalDecimal(instance, &clock, 1, &seconds, &qualifier), "fmi3GetIntervalDecimal");
    return qualifier == fmi3IntervalNotYetKnown ? 1e9 : seconds;
}

static void update(fmi3Instance instance)
{
    fmi3Boolean flags[5];
    double next;
    must(fmi3UpdateDiscreteStates(instance, &flags[0], &flags[1], &flags[2], &flags[3], &flags[4], &next), "update");
}

/* Everything that is there to be sent; a sum of its bytes. */
static unsigned long drain(fmi3Instance instance)
{
    const fmi3ValueReference clock = QB_TX_CLOCK, data = QB_TX_DATA;
    const fmi3Clock ticks = fmi3True;
    unsigned long sum = 0;
    while (interval(instance) <= 0.0) {
        fmi3Binary bytes;
        size_t size, k;
        must(fmi3SetClock(instance, &clock, 1, &ticks), "fmi3SetClock");
        must(fmi3GetBinary(instance, &data, 1, &size, &bytes, 1), "fmi3GetBinary");
        look(bytes, size);
        for (k = 0; k < size; k++) {
            sum = sum * 31 + bytes[k];
        }
        update(instance);
    }
    return sum;
}

static void give(fmi3Instance instance, const uint8_t *bytes, size_t size)
{
    const fmi3ValueReference clock = QB_RX_CLOCK, data = QB_RX_DATA;
    const fmi3Clock ticks = fmi3True;
    const fmi3Binary value = bytes;
    must(fmi3SetClock(instance, &clock, 1, &ticks), "fmi3SetClock");
    must(fmi3SetBinary(instance, &data, 1, &size, &value, 1), "fmi3SetBinary");
    update(instance);
}

static void step(fmi3Instance instance, double size)
{
    fmi3Boolean event, terminate, early;
    double reached;
    must(fmi3EnterStepMode(instance), "fmi3EnterStepMode");
    must(fmi3DoStep(instance, now, size, fmi3False, &event, &terminate, &early, &reached), "fmi3DoStep");
    now += size;
    must(fmi3EnterEventMode(instance), "fmi3EnterEventMode");
}

static void check_outputs(fmi3Instance instance)
{
    fmi3ValueReference reference;
    for (reference = 0; reference < QO_VARIABLES; reference++) {
        double value = 0.0;
        if (qo_variables[reference].role == QO_STATE || qo_variables[reference].role == QO_OUTPUT) {
            must(fmi3GetFloat64(instance, &reference, 1, &value, 1), "fmi3GetFloat64");
        }
        if (!isfinite(value)) {
            fail("an output is not finite");
        }
    }
}

/* A saved state goes on as it went on. */
static void repeat(fmi3Instance instance)
{
    fmi3FMUState state = NULL;
    const double before = now;
    unsigned long first;
    must(fmi3GetFMUState(instance, &state), "fmi3GetFMUState");
    step(instance, 0.004);
    first = drain(instance);
    must(fmi3SetFMUState(instance, state), "fmi3SetFMUState");
    must(fmi3FreeFMUState(instance, &state), "fmi3FreeFMUState");
    now = before;
    step(instance, 0.004);
    if (drain(instance) != first) {
        fail("a restored state sends something else");
    }
}

int main(int count, char **arguments)
{
    const unsigned long wanted = count > 2 ? strtoul(arguments[2], NULL, 10) : 1000;
    static uint8_t bytes[BATCH * 64];
    fmi3Instance instance;
    unsigned long rounds = 0;
    seed = count > 1 ? strtoull(arguments[1], NULL, 10) : 1;
    random_state = seed * 0x9E3779B97F4A7C15ULL + 1;
    instance = fmi3InstantiateCoSimulation("fuzz", qo_token, NULL, 0, 0, 1, 0, NULL, 0, NULL, hear, NULL);
    must(instance == NULL ? fmi3Error : fmi3OK, "fmi3InstantiateCoSimulation");
    must(fmi3EnterInitializationMode(instance, 0, 0.0, 0.0, 0, 0.0), "fmi3EnterInitializationMode");
    must(fmi3ExitInitializationMode(instance), "fmi3ExitInitializationMode");
    for (; frames_given < wanted; rounds++) {
        const unsigned long errors = format_errors;
        const int nonsense = below(30) == 0;
        size_t size = 0;
        unsigned k, many = 1 + below(BATCH);
        for (k = 0; k < many && !nonsense; k++) {
            size += give_frame(bytes + size);
        }
        if (nonsense) {
            size = give_nonsense(bytes);
        }
        give(instance, bytes, size);
        drain(instance);
        if (nonsense && format_errors == errors && (size < 8 || bytes[0] > 0x42 || bytes[1] || bytes[2] || bytes[3])) {
            fail("nonsense is not answered by a format error");
        }
        if (below(3) == 0) {
            const double limit = interval(instance), size_of_step = 1e-4 * (1 + below(200));
            step(instance, limit > 0.0 && limit < size_of_step && below(2) ? limit : size_of_step);
            drain(instance);
        }
        if (below(500) == 0) {
            repeat(instance);
        }
        if (below(200) == 0) {
            check_outputs(instance);
        }
    }
    must(fmi3Terminate(instance), "fmi3Terminate");
    fmi3FreeInstance(instance);
    printf("%lu frames given in %.1f s, %lu sent, %lu emergencies, %lu times nonsense, %lu format errors\n", frames_given,
           now, frames_sent, emergencies, malformed, format_errors);
    return 0;
}
