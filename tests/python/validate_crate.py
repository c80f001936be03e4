"""Validates an RO-Crate against profile 1.1 with other people's programs: all requirements, and what the profile recommends.

Argument: the folder. Nothing is fetched: the JSON-LD context comes from the package `rocrate`, whose later version has the
same terms.
"""

import io
import json
import sys
import urllib.request
import urllib.response
from email.message import Message
from importlib.resources import files
from pathlib import Path

import requests
from rocrate.rocrate import ROCrate
from rocrate_validator import models, services

CONTEXT = files("rocrate").joinpath("data/ro-crate.jsonld").read_bytes()


def opened(self, request, *rest, **more):
    url = request if isinstance(request, str) else request.full_url
    assert url.startswith("https://w3id.org/ro/crate/"), url
    headers = Message()
    headers["Content-Type"] = "application/ld+json"
    return urllib.response.addinfourl(io.BytesIO(CONTEXT), headers, url, 200)


def sent(self, request, **more):
    assert request.url.startswith("https://w3id.org/ro/crate/"), request.url
    response = requests.Response()
    response.status_code, response._content, response.url, response.request = 200, CONTEXT, request.url, request
    response.headers["Content-Type"] = "application/ld+json"
    return response


urllib.request.OpenerDirector.open = opened
requests.Session.send = sent

folder = Path(sys.argv[1])
settings = services.ValidationSettings(
    rocrate_uri=str(folder),
    profile_identifier="ro-crate-1.1",
    requirement_severity=models.Severity.RECOMMENDED,
    disable_remote_crate_download=True,
    no_cache=True,
)
result = services.validate(settings)
issues = [f"{i.severity.name} {i.check.identifier}: {i.message}" for i in result.get_issues()]
assert not issues, "\n".join(issues)

# Every file has an entity with its size, and a reader of crates finds what a person looks for.
crate = ROCrate(str(folder))
described = {e.id: e for e in crate.data_entities if e.type == "File"}
present = {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()} - {"ro-crate-metadata.json"}
assert set(described) == present, set(described) ^ present
for name, entity in described.items():
    assert int(entity["contentSize"]) == (folder / name).stat().st_size, name
assert crate.root_dataset["author"].id.startswith("https://orcid.org/")
headline = json.loads((folder / "headline.json").read_text())
measured = crate.root_dataset["variableMeasured"]
numbers = {e["name"]: e["value"] for e in (measured if isinstance(measured, list) else [measured])}
for session in headline["sessions"]:
    rmse = next(n for n in session["numbers"] if (n["set"], n["metric"]) == ("scored", "rmse"))
    assert numbers[f"scored rmse of {session['bundle']}"] == rmse["value"]
print(len(result.executed_checks), "checks")
