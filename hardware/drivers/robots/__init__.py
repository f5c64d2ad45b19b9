"""Arms that another program or library commands: a Python object of the user's, a LeRobot robot, a ROS 2 controller; one arm over any.

May import: `hardware.drivers.arms`, `hardware.transport`, `oio`; LeRobot and ROS 2 only where a robot is made. May not import: servos,
noses, valves, worlds.
"""
