#include "values.h"

#include "dr_words.h" /* names of stages, numbers for people */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define MICRO UINT64_C(1000000)
#define TIME_MAX_S UINT64_C(3600000)

/* Reads a number of up to 9 digits, with decimals, in millionths. Returns what stands behind it; NULL: it is no number. */
static const char *read_millionths(const char *text, uint64_t *millionths)
{
    const size_t whole = strspn(text, "0123456789");
    if (whole == 0 || whole > 9)
        return NULL;
    *millionths = strtoull(text, NULL, 10) * MICRO;
    text += whole;
    if (*text != '.')
        return text;
    uint64_t worth = MICRO / 10u;
    for (text++; *text >= '0' && *text <= '9'; text++, worth /= 10u)
        *millionths += worth * (uint64_t)(*text - '0');
    return text;
}

bool values_number(const char *text, unsigned least, unsigned most, unsigned *number, char why[WHY_ROOM])
{
    const size_t digits = strspn(text, "0123456789");
    const unsigned long value = digits > 0 && digits < 9 && text[digits] == '\0' ? strtoul(text, NULL, 10) : most + 1ul;
    if (value < least || value > most) {
        (void)snprintf(why, WHY_ROOM, "expected a whole number from %u to %u", least, most);
        return false;
    }
    *number = (unsigned)value;
    return true;
}

bool values_point(const char *text, dr_stage_id id, uint32_t steps[DR_AXES], char why[WHY_ROOM])
{
    static const char *const shape =
        "expected X,Y,Z in whole microsteps, as 16000,0,400, or in microns, as 100um,0um,12.5um";
    uint64_t millionths[DR_AXES];
    uint32_t at_steps[DR_AXES];
    bool in_um[DR_AXES];
    dr_stage stage;
    (void)dr_stage_get(id, &stage);

    const char *rest = text;
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        rest = read_millionths(rest, &millionths[axis]);
        if (rest != NULL) {
            in_um[axis] = strncasecmp(rest, "um", 2) == 0;
            rest += in_um[axis] ? 2 : 0;
        }
        if (rest == NULL || *rest != (axis + 1u < DR_AXES ? ',' : '\0')) {
            (void)snprintf(why, WHY_ROOM, "%s", shape);
            return false;
        }
        rest++;
    }
    if (in_um[DR_Z] && !in_um[DR_X] && !in_um[DR_Y]) /* 100,200,300um: said once, meant for all */
        in_um[DR_X] = in_um[DR_Y] = true;

    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        if (in_um[axis] != in_um[0]) {
            (void)snprintf(why, WHY_ROOM, "microns or microsteps, not both");
            return false;
        }
        if (!in_um[axis] && millionths[axis] % MICRO != 0) {
            (void)snprintf(why, WHY_ROOM, "microsteps are whole; microns are written with um");
            return false;
        }
        const uint64_t unit = in_um[axis] ? MICRO * stage.quanta_per_step : MICRO;
        const uint64_t at = (millionths[axis] * (in_um[axis] ? DR_QUANTA_PER_UM : 1u) + unit / 2u) / unit;
        if (at > stage.travel_steps[axis]) {
            char most[32], most_um[32];
            (void)dr_words_number(most, sizeof most, stage.travel_steps[axis]);
            (void)dr_words_um(most_um, sizeof most_um, (uint64_t)stage.travel_steps[axis] * stage.quanta_per_step);
            (void)snprintf(why, WHY_ROOM, "%c is beyond the travel of %s, which is 0 to %s steps (%s um)", "XYZ"[axis],
                           dr_words_stage(id), most, most_um);
            return false;
        }
        at_steps[axis] = (uint32_t)at;
    }
    memcpy(steps, at_steps, sizeof at_steps);
    return true;
}

/* 0 to 6 are steeper than 45 degrees, 8 to 15 less steep. */
bool values_diagonal(const char *text, uint8_t *diagonal, char why[WHY_ROOM])
{
    static const uint8_t degrees[DR_DIAGONALS] = {11, 14, 21, 27, 29, 35, 39, 45, 39, 35, 29, 27, 21, 14, 11, 7};
    const unsigned even = 7;
    char *rest;
    const unsigned long angle = strtoul(text, &rest, 10);
    rest += strspn(rest, " -,:");
    const bool more = strcasecmp(rest, "more") == 0;
    const bool less = strcasecmp(rest, "less") == 0;
    if (rest != text && (more || less || *rest == '\0'))
        for (unsigned value = more ? 0 : even; value < DR_DIAGONALS; value++)
            if (degrees[value] == angle && !(value == even && (more || less)) && !(more && value > even)) {
                *diagonal = (uint8_t)value;
                return true;
            }
    (void)snprintf(why, WHY_ROOM,
                   "expected 7, 11, 14, 21, 27, 29, 35 or 39, less steep than 45 degrees; 45; or "
                   "11more, 14more, 21more, 27more, 29more, 35more or 39more, steeper");
    return false;
}

bool values_time_us(const char *text, uint64_t *us, char why[WHY_ROOM])
{
    static const struct {
        const char *name;
        uint64_t us;
    } units[] = {{"us", 1}, {"ms", 1000}, {"s", MICRO}, {"min", 60u * MICRO}, {"h", 3600u * MICRO}};
    uint64_t millionths;
    const char *const unit = read_millionths(text, &millionths);
    for (size_t i = 0; unit != NULL && i < sizeof units / sizeof units[0]; i++) {
        if (strcmp(unit, units[i].name) != 0)
            continue;
        const uint64_t whole = millionths / MICRO, part_us = millionths % MICRO * units[i].us / MICRO;
        if (whole > TIME_MAX_S * MICRO / units[i].us || whole * units[i].us + part_us > TIME_MAX_S * MICRO)
            break;
        *us = whole * units[i].us + part_us;
        return true;
    }
    (void)snprintf(why, WHY_ROOM, "expected a time with its unit: 80us, 250ms, 1.5s, 3min or 2h; 1000h at most");
    return false;
}

bool values_millionths(const char *text, uint32_t *millionths, char why[WHY_ROOM])
{
    uint64_t value;
    const char *const rest = read_millionths(text, &value);
    const bool is_percent = rest != NULL && *rest == '%';
    if (rest == NULL || rest[is_percent ? 1 : 0] != '\0' || value > (is_percent ? 100u : 1u) * MICRO) {
        (void)snprintf(why, WHY_ROOM, "expected a probability: 0.01 or 1%%");
        return false;
    }
    *millionths = (uint32_t)(is_percent ? value / 100u : value);
    return true;
}
