"""A policy as an app of the Crazyflie's firmware, around the C of `write_c`: `e2efly export --c --crazyflie`.

The app uses what the firmware documents for apps: `appMain`, log variables, parameters, set-points of the commander and
the high-level commander (https://www.bitcraze.io/documentation/repository/crazyflie-firmware/master/userguides/app_layer/).
"""

from pathlib import Path
from string import Template

from e2efly.config.storage import write_atomically
from e2efly.policy.c_export.header import field_name
from e2efly.policy.c_export.text import comment, number
from e2efly.policy.contract import Contract
from e2efly.policy.observation import PAST_ACTIONS
from e2efly.vehicles.vehicle import Vehicle

KNOWN = {
    "position_error": ("target[i] - logGetFloat(watched.position[i])", 3),
    "attitude": ("logGetFloat(watched.attitude[i])", 4),
    "velocity": ("logGetFloat(watched.velocity[i])", 3),
    "body_rate": ("logGetFloat(watched.gyro[i]) * RADIANS", 3),
}
"""What the app can tell a policy: an expression of C for entry i of a field, and the field's size."""
_APP = Template("""\
$about
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "FreeRTOS.h"
#include "task.h"

#include "app.h"
#include "commander.h"
#include "crtp_commander_high_level.h"
#include "log.h"
#include "param.h"
#include "stabilizer_types.h"
#include "supervisor.h"

#include "$name.h"

#define PERIOD_US ${period}u /* from step to step */
#define MASS_KG $mass
#define FULL_THRUST_N $full /* of one rotor */
#define ROTORS 4.0f
#define FULL 65535.0f /* thrust of a set-point at which motors are at full power */
#define RADIANS 0.0174532925f
#define LAND_SPEED 0.4f
#define POLL_MS 10

static ${name}_state state;
static uint8_t fly;                                /* 1: the policy flies. Set it in the air; 0 hands over and lands */
static float target[3] = {0.0f, 0.0f, 1.0f};       /* m */
static float reach = 2.0f;                         /* farther than this from the target, m, it hands over and lands */
static float ground;                               /* height of the place to land on, m */
static float factor = 1.0f;                        /* thrust of this vehicle over that of its file, as fly learns it */
static uint16_t posed = 200;                       /* largest age of poses that come by radio, ms. 0: none come so */

static struct {
    logVarId_t position[3], velocity[3], attitude[4], gyro[3], tick;
    bool found;
} watched;

static void find(void)
{
    static char *const axes[3] = {"x", "y", "z"};
    static char *const speeds[3] = {"vx", "vy", "vz"};
    static char *const parts[4] = {"qw", "qx", "qy", "qz"};
    watched.tick = logGetVarId("locSrvZ", "tick");
    watched.found = logVarIdIsValid(watched.tick);
    for (int i = 0; i < 3; i++) {
        watched.position[i] = logGetVarId("stateEstimate", axes[i]);
        watched.velocity[i] = logGetVarId("stateEstimate", speeds[i]);
        watched.gyro[i] = logGetVarId("gyro", axes[i]);
        watched.found = watched.found && logVarIdIsValid(watched.position[i])
            && logVarIdIsValid(watched.velocity[i]) && logVarIdIsValid(watched.gyro[i]);
    }
    for (int i = 0; i < 4; i++) {
        watched.attitude[i] = logGetVarId("stateEstimate", parts[i]);
        watched.found = watched.found && logVarIdIsValid(watched.attitude[i]);
    }
}

/* Whether the policy may fly: in the air, near the target, with fresh poses. */
static bool may_fly(void)
{
    float square = 0.0f;
    if (!watched.found || !supervisorIsFlying() || supervisorIsTumbled()) return false;
    if (posed != 0 && (uint16_t)(xTaskGetTickCount() - logGetUint(watched.tick)) > posed) return false;
    for (int i = 0; i < 3; i++) {
        const float off = target[i] - logGetFloat(watched.position[i]);
        square += off * off;
    }
    return square <= reach * reach; /* false for NaN, too */
}

/* One step: the set-point for what is estimated now. Returns whether there is one. */
static bool step(setpoint_t *setpoint)
{
    ${name}_seen seen;
    float action[4], command[4];
$seen
    if (${name}_act(&state, &seen, action) != ${big}_OK) return false;
    ${name}_command(action, command);
    const float share = MASS_KG * command[0] / (ROTORS * FULL_THRUST_N * factor);
    *setpoint = (setpoint_t){0};
    setpoint->mode.roll = setpoint->mode.pitch = setpoint->mode.yaw = modeVelocity;
    setpoint->attitudeRate.roll = command[1] / RADIANS;
    setpoint->attitudeRate.pitch = -command[2] / RADIANS; /* the firmware's pitch is opposite */
    setpoint->attitudeRate.yaw = command[3] / RADIANS;
    setpoint->thrust = fminf(fmaxf(FULL * share, 1.0f), FULL); /* 0 would stop the motors */
    return true;
}

/* The high-level commander lands. It is on board, and needs neither this app nor the radio. */
static void hand_over(void)
{
    const float height = logGetFloat(watched.position[2]) - ground;
    commanderRelaxPriority();
    crtpCommanderHighLevelLand(ground, fmaxf(height / LAND_SPEED, 1.0f));
}

void appMain(void)
{
    bool flies = false;
    uint32_t begun = 0, steps = 0;
    find();
    for (;;) {
        setpoint_t setpoint;
        if (!flies) {
            if (fly == 0 || !may_fly()) {
                fly = 0; /* refused: it must be set anew */
                vTaskDelay(M2T(POLL_MS));
                continue;
            }
            ${name}_begin(&state);
            begun = xTaskGetTickCount();
            steps = 0;
            flies = true;
        }
        if (fly == 0 || !may_fly() || !step(&setpoint)) {
            flies = false;
            fly = 0;
            hand_over();
            continue;
        }
        commanderSetSetpoint(&setpoint, COMMANDER_PRIORITY_EXTRX);
        steps++;
        const uint32_t due = begun + M2T((uint64_t)steps * PERIOD_US / 1000u);
        const uint32_t now = xTaskGetTickCount();
        if ((int32_t)(due - now) > 0) vTaskDelay(due - now);
    }
}

PARAM_GROUP_START(e2efly)
PARAM_ADD(PARAM_UINT8, fly, &fly)
PARAM_ADD(PARAM_FLOAT, x, &target[0])
PARAM_ADD(PARAM_FLOAT, y, &target[1])
PARAM_ADD(PARAM_FLOAT, z, &target[2])
PARAM_ADD(PARAM_FLOAT, reach, &reach)
PARAM_ADD(PARAM_FLOAT, ground, &ground)
PARAM_ADD(PARAM_FLOAT, factor, &factor)
PARAM_ADD(PARAM_UINT16, posed, &posed)
PARAM_GROUP_STOP(e2efly)
""")
CONFIG = "CONFIG_APP_ENABLE=y\nCONFIG_APP_PRIORITY=1\nCONFIG_APP_STACKSIZE=700\n"
"""Options of the firmware's build."""
MAKE = """\
# make CRAZYFLIE_BASE=path/to/crazyflie-firmware
CRAZYFLIE_BASE ?= ../crazyflie-firmware
OOT_CONFIG := $(CURDIR)/app-config
include $(CRAZYFLIE_BASE)/tools/make/oot.mk
"""


def check_app(contract: Contract) -> None:
    """Refuse a policy that the app cannot fly.

    Raises:
        ValueError: naming what it sees or commands, and what is accepted.
    """
    if contract.action.mode != "ctbr":
        raise ValueError(f"--crazyflie: the policy commands {contract.action.mode!r}; accepted: ctbr")
    sees = [*(part.name for part in contract.observation), *(image.name for image in contract.images)]
    unknown = [name for name in sees if name not in (*KNOWN, PAST_ACTIONS)]
    if unknown:
        raise ValueError(
            f"--crazyflie: the policy sees {', '.join(unknown)}, which the app does not know; accepted: a policy that "
            f"sees {', '.join(KNOWN)}, such as crazyflie/hover and crazyflie/land"
        )


def app_source(contract: Contract, name: str, vehicle: Vehicle) -> str:
    """The file NAME_app.c.

    Args:
        contract: of the policy; see `check_app`.
        name: the prefix of the policy's C.
        vehicle: its mass and its full thrust turn the policy's thrust into that of set-points.
    """
    seen = []
    for part in contract.observation:
        if part.name != PAST_ACTIONS:
            expression, size = KNOWN[part.name]
            seen.append(f"    for (int i = 0; i < {size}; i++) seen.{field_name(part.name)}[i] = {expression};")
    about = comment(
        f"{name}_app: the policy of {name}.h as an app of the Crazyflie's firmware. Made by e2efly export --c "
        "--crazyflie. Take off by the high-level commander, set e2efly.x, y, z, then e2efly.fly to 1. The policy hands "
        "over to the high-level commander, which lands, when e2efly.fly is set to 0, when it is too far from the "
        "target, when poses no longer come, or when it has no valid command."
    )
    return _APP.substitute(
        about=about, name=name, big=name.upper(), period=round(1e6 / contract.control_rate_hz),
        mass=number(float(vehicle.mass)), full=number(vehicle.thrust_range[1]), seen="\n".join(seen),
    )  # fmt: skip


def write_app(folder: Path, contract: Contract, name: str, vehicle: Vehicle) -> None:
    """Write NAME_app.c and what the firmware's build needs beside it, into the folder of the policy's C."""
    for path, text in (
        (f"{name}_app.c", app_source(contract, name, vehicle)),
        ("Kbuild", f"obj-y += {name}.o {name}_app.o\n"),
        ("app-config", CONFIG),
        ("Makefile", MAKE),
    ):
        write_atomically(folder / path, text.encode())
