/* An exported app in a firmware of ours: time that passes in vTaskDelay, estimates that the test sets, and a record of
 * what the app asks for. */
#include "policy_app.c"

#include <setjmp.h>
#include <stdio.h>
#include <string.h>

static const char *const names[] = {
    "stateEstimate.x", "stateEstimate.y", "stateEstimate.z", "stateEstimate.vx", "stateEstimate.vy",
    "stateEstimate.vz", "stateEstimate.qw", "stateEstimate.qx", "stateEstimate.qy", "stateEstimate.qz", "gyro.x",
    "gyro.y", "gyro.z", "locSrvZ.tick",
};
enum { COUNT = sizeof names / sizeof *names };
static float values[COUNT] = {0, 0, 1, 0, 0, 0, 1};
static uint32_t ticks, posed_at, ends;
static bool in_the_air, pose_comes = true;
static jmp_buf end;

uint32_t xTaskGetTickCount(void) { return ticks; }
static void happens(void);
void vTaskDelay(uint32_t passing)
{
    while (passing-- > 0) {
        ticks++;
        if (pose_comes) posed_at = ticks;
        happens();
        if (ticks >= ends) longjmp(end, 1);
    }
}
logVarId_t logGetVarId(const char *group, const char *name)
{
    char whole[40];
    snprintf(whole, sizeof whole, "%s.%s", group, name);
    for (int i = 0; i < COUNT; i++)
        if (strcmp(names[i], whole) == 0) return (logVarId_t)i;
    return 0xffff;
}
bool logVarIdIsValid(logVarId_t id) { return id < COUNT; }
float logGetFloat(logVarId_t id) { return values[id]; }
unsigned int logGetUint(logVarId_t id) { return id == COUNT - 1 ? posed_at & 0xffff : 0; }
bool supervisorIsFlying(void) { return in_the_air; }
bool supervisorIsTumbled(void) { return false; }
void commanderSetSetpoint(setpoint_t *s, int priority)
{
    const bool rates = s->mode.roll == modeVelocity && s->mode.pitch == modeVelocity && s->mode.yaw == modeVelocity
        && s->mode.x == modeDisable && s->mode.y == modeDisable && s->mode.z == modeDisable;
    printf("%u setpoint %d %d %.9g %.9g %.9g %.9g\n", (unsigned)ticks, priority, rates, (double)s->attitudeRate.roll,
           (double)s->attitudeRate.pitch, (double)s->attitudeRate.yaw, (double)s->thrust);
}
void commanderRelaxPriority(void) { printf("%u relax\n", (unsigned)ticks); }
int crtpCommanderHighLevelLand(float height, float duration)
{
    return printf("%u land %g %g\n", (unsigned)ticks, (double)height, (double)duration);
}

/* The story of a flight: asked on the ground, asked in the air, poses that end, asked again, taken back, too far. */
static void happens(void)
{
    if (ticks == 50) fly = 1;
    if (ticks == 100) in_the_air = true;
    if (ticks == 150) fly = 1;
    if (ticks == 300) pose_comes = false;
    if (ticks == 800) pose_comes = true;
    if (ticks == 810) fly = 1;
    if (ticks == 900) fly = 0;
    if (ticks == 1000) fly = 1;
    if (ticks == 1040) values[0] = 5.0f;
}

int main(void)
{
    target[0] = 0.3f;
    target[1] = 0.2f;
    ends = 1200;
    if (setjmp(end) == 0) appMain();
    return 0;
}

/* One step for a flight in which Python holds the body: (13) estimates, (4) set-point. Returns whether there is one. */
int flown_step(const float estimates[13], int first, float out[4])
{
    setpoint_t setpoint;
    memcpy(values, estimates, 13 * sizeof *values);
    if (first) {
        find();
        policy_begin(&state);
        target[0] = target[1] = 0.3f;
    }
    if (!step(&setpoint)) return 0;
    out[0] = setpoint.attitudeRate.roll;
    out[1] = setpoint.attitudeRate.pitch;
    out[2] = setpoint.attitudeRate.yaw;
    out[3] = setpoint.thrust;
    return 1;
}
