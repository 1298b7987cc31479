/* What the Crazyflie's firmware documents for apps, as far as an exported app uses it: our own words, for the host. */
#ifndef FIRMWARE_H
#define FIRMWARE_H
#include <stdbool.h>
#include <stdint.h>

typedef uint16_t logVarId_t;
typedef enum { modeDisable = 0, modeAbs, modeVelocity } stab_mode_t;
typedef struct { float roll, pitch, yaw; } attitude_t;
typedef struct {
    attitude_t attitude, attitudeRate;
    float thrust;
    struct { stab_mode_t x, y, z, roll, pitch, yaw, quat; } mode;
} setpoint_t;

#define M2T(X) ((unsigned int)(X))
#define COMMANDER_PRIORITY_EXTRX 3
#define PARAM_GROUP_START(NAME)
#define PARAM_ADD(TYPE, NAME, ADDRESS) _Static_assert(sizeof(*(ADDRESS)) == (TYPE), "size of a parameter");
#define PARAM_GROUP_STOP(NAME) _Static_assert(1, "");
#define PARAM_UINT8 1
#define PARAM_UINT16 2
#define PARAM_FLOAT 4

void appMain(void);
uint32_t xTaskGetTickCount(void);
void vTaskDelay(uint32_t ticks);
logVarId_t logGetVarId(const char *group, const char *name);
bool logVarIdIsValid(logVarId_t id);
float logGetFloat(logVarId_t id);
unsigned int logGetUint(logVarId_t id);
bool supervisorIsFlying(void);
bool supervisorIsTumbled(void);
void commanderSetSetpoint(setpoint_t *setpoint, int priority);
void commanderRelaxPriority(void);
int crtpCommanderHighLevelLand(float height, float duration);
#endif
