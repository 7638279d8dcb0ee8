#!/usr/bin/env python3
"""Reads YAML files as roslaunch does and writes what it would hand to the parameter server as XML-RPC beside each: FILE.xml.

No FILE.xml: roslaunch refuses the file. Usage: roslaunch_reading.py FILE ...
"""
import sys
import xmlrpc.client

import rosparam  # teaches PyYAML deg(...), rad(...)
import yaml

assert rosparam
for path in sys.argv[1:]:
    try:
        with open(path, encoding="utf-8") as file:
            value = yaml.safe_load(file.read())
        xml = xmlrpc.client.dumps((value,))
    except Exception as error:  # whatever is wrong, roslaunch ends
        print(path, "refused:", type(error).__name__)
        continue
    with open(path + ".xml", "w", encoding="utf-8") as file:
        file.write(xml[xml.index("<value>"):xml.rindex("</value>") + len("</value>")])
