"""A publish step for results of Calmotion, as plugins of pyblish: collect manifests, validate, integrate.

What is published has kept its tolerance, exceeds no limit, and is of exactly the files that lie there now.
"""

import os
import shutil
import sys
from pathlib import Path

import calmotion as cm
import pyblish.api
from calmotion.workflow.manifest import read_manifest

FAMILY = "calmotion.result"


class CollectCalmotionResults(pyblish.api.ContextPlugin):
    """One instance for each manifest in `$CALMOTION_RESULTS`."""

    label = "Collect results of Calmotion"
    order = pyblish.api.CollectorOrder

    def process(self, context):
        """Called by pyblish."""
        for path in sorted(Path(os.environ["CALMOTION_RESULTS"]).glob("*.manifest.json")):
            instance = context.create_instance(path.name.removesuffix(".manifest.json"), family=FAMILY)
            instance.data["manifest"] = str(path)


class ValidateCalmotionResult(pyblish.api.InstancePlugin):
    """The verdict, the hashes, and `calmotion inspect --strict`."""

    label = "Validate a result of Calmotion"
    order = pyblish.api.ValidatorOrder
    families = [FAMILY]

    def process(self, instance):
        """Called by pyblish."""
        problems = cm.publishing_problems(instance.data["manifest"])
        for problem in problems:
            self.log.error(problem.message())
        if problems:
            raise pyblish.api.ValidationError(f"{instance.name}: " + "; ".join(p.problem for p in problems))


class IntegrateCalmotionResult(pyblish.api.InstancePlugin):
    """Copies the outputs and the manifest into a new version below `$CALMOTION_PUBLISHED`."""

    label = "Integrate a result of Calmotion"
    order = pyblish.api.IntegratorOrder
    families = [FAMILY]

    def process(self, instance):
        """Called by pyblish."""
        manifest = Path(instance.data["manifest"])
        folder = Path(os.environ["CALMOTION_PUBLISHED"]) / instance.name
        folder.mkdir(parents=True, exist_ok=True)
        number = 1 + max((int(path.name[1:]) for path in folder.glob("v[0-9]*")), default=0)
        version = folder / f"v{number:03d}"
        incomplete = folder / f".{version.name}.incomplete"
        shutil.rmtree(incomplete, ignore_errors=True)
        incomplete.mkdir()
        for row in read_manifest(manifest)["outputs"]:
            shutil.copy2(manifest.parent / row["path"], incomplete / Path(row["path"]).name)
        shutil.copy2(manifest, incomplete / manifest.name)
        os.rename(incomplete, version)  # a version is there whole, or not at all
        instance.data["published"] = str(version)


PLUGINS = (CollectCalmotionResults, ValidateCalmotionResult, IntegrateCalmotionResult)


def publish():
    """Run the three plugins; the context, with a record of each."""
    import pyblish.util

    return pyblish.util.publish(plugins=list(PLUGINS))


if __name__ == "__main__":
    results = publish().data["results"]
    for result in results:
        if result["error"]:
            print(f"{result['plugin'].label}: {result['error']}")
    sys.exit(any(not result["success"] for result in results))
