"""Validates an XML file against a schema: validate.py SCHEMA FILE. A document that is broken on purpose must be refused."""

import sys

from lxml import etree

schema = etree.XMLSchema(etree.parse(sys.argv[1]))
document = etree.parse(sys.argv[2])
schema.assertValid(document)

for damage in ("testcase", "testsuite"):
    broken = etree.parse(sys.argv[2])
    del broken.find(f".//{damage}").attrib["name"]
    if schema.validate(broken):
        sys.exit(f"expected a {damage} without a name to be refused")
for text in ("twelve", "-1"):
    broken = etree.parse(sys.argv[2])
    broken.getroot().set("tests", text)
    if schema.validate(broken):
        sys.exit(f"expected tests='{text}' to be refused")
