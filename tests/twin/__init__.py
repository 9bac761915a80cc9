"""A second robot for blind tests: other bodies, other integration, other contact, same physics.

It shares no code with the product, so that a discovery tested on its logs is not tested on itself.

    cases     robot_case, bench_case: logs with hidden effects, and the truth
    run       simulate: one script on the robot          bench     simulate: one test on the rig
    repertoire  planned motions by name and seed    rigs      what the rig is made to do
    scripts   own scripts, controller tables             measure   sensors, noise, sensor faults
    catalogue the effects                                figures   the robot's numbers

The physics is in `bodies` (rigid bodies and multipliers), `contact`, `air`, `loads`, `machine`.
"""
