"""A second twin on MuJoCo: bodies, contact and dry friction by an engine nobody here wrote.

Ground and loops give way a little, the boom bends, every sensor has a filter and a colour of its
own. Only the motions, the hip controller and the table format are those of `twin`.

    cases     robot_case: logs with hidden effects, and the truth
    machine   Machine, run: one script on the robot
    hidden    what is wrong with a machine      mjcf   the robot's file as MuJoCo reads it
    air       chambers (eq. 1 to 7)             sensors   filters, colours, steps, faults
"""
