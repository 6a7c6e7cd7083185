/* observe_json: an observation as a JSON object, for `subscribe` and for traces that programs read. dryrig-control.7 lists
 * its keys.
 * Thread-safety: functions of their arguments only. */
#ifndef OBSERVE_JSON_H
#define OBSERVE_JSON_H

#include "observe.h"

#include <cjson/cJSON.h>

/* NULL: no memory. The caller deletes it. */
cJSON *observe_json(const observation *seen);

#endif
