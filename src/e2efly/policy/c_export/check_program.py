"""NAME_check.c: a program that runs an exported policy on known inputs and reports how accurate and how fast it is."""

import numpy as np

from e2efly.policy.c_export.exact import Exact
from e2efly.policy.c_export.header import Precision, image_name, image_size
from e2efly.policy.c_export.text import array, comment, number
from e2efly.policy.contract import Contract
from e2efly.policy.random_inputs import random_images, random_observations

STEPS = 8
"""Number of steps that are compared, one after the other, from an empty memory."""
ROUNDS = 2000
"""Number of steps that are timed."""
CLOSE: dict[Precision, float] = {"double": 1e-6, "float": 1e-5}
"""Largest accepted difference between an action and the exact value of the policy.onnx."""


def check_source(contract: Contract, content: bytes, name: str, precision: Precision) -> str:
    """The program, with random observations and images and the exact actions for them. Arguments as for
    `e2efly.policy.c_export.c_source.sources`.
    """
    rng, exact = np.random.default_rng(0), Exact(contract, content)
    observation = random_observations(rng, contract.observation, STEPS)
    images = [random_images(rng, image, STEPS) for image in contract.images]
    size = contract.action.size
    memory, actions = np.zeros((1, contract.memory_size)), np.empty((STEPS, size))
    for k in range(STEPS):
        actions[k], memory = exact.act(observation[k : k + 1], [x[k : k + 1] for x in images], memory)
    given = "".join(f" {image_name(image.name)} + {image_size(image)} * (k % {STEPS})," for image in contract.images)
    return "\n".join(
        [
            comment(
                f"Is {name}.c the policy, and how fast? cc -O2 -std=c99 {name}.c {name}_check.c -lm -o check && ./check"
            ),
            f'#include "{name}.h"\n\n#include <math.h>\n#include <stdio.h>\n#include <time.h>\n',
            array("static const float", "observation", map(number, observation.reshape(-1))),
            *(
                array("static const float", image_name(i.name), map(number, x.reshape(-1)))
                for i, x in zip(contract.images, images, strict=True)
            ),
            array("static const double", "wanted", map(repr, actions.reshape(-1).tolist())),
            f"static {name}_state state;\n",
            f"static {name}_status step(int k, float action[{size}])\n{{",
            f"    return {name}_network(&state, observation + {contract.observation_size} * (k % {STEPS}),"
            f"{given} action);\n}}\n",
            "int main(void)\n{",
            f"    float action[{size}];",
            "    double worst = 0.0;",
            "    clock_t began;",
            f"    {name}_begin(&state);",
            f"    for (int k = 0; k < {STEPS}; k++) {{",
            f"        const {name}_status status = step(k, action);",
            f"        if (status != {name.upper()}_OK) {{",
            '            printf("step %d: status %d\\n", k, (int)status);',
            "            return 1;",
            "        }",
            f"        for (int i = 0; i < {size}; i++)",
            f"            worst = fmax(worst, fabs((double)action[i] - wanted[{size} * k + i]));",
            "    }",
            "    began = clock();",
            f"    for (int k = 0; k < {ROUNDS}; k++) (void)step(k, action);",
            f'    printf("largest difference %.2g, accepted {CLOSE[precision]:g}; %.1f us a step\\n", worst,',
            f"           1e6 * (double)(clock() - began) / CLOCKS_PER_SEC / {ROUNDS});",
            f"    return worst <= {CLOSE[precision]!r} ? 0 : 1;",
            "}\n",
        ]
    )
