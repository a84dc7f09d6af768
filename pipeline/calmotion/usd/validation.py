"""Calmotion's rules: functions from a stage to findings."""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeAlias

import numpy as np
from pxr import Sdf, Usd, UsdValidation

from calmotion.errors import ShotError, each
from calmotion.model.outputs import ERROR, WARNING, Finding, Findings
from calmotion.usd import stages
from calmotion.usd.diagnostics import quiet, with_places
from calmotion.usd.reading.context import prims_of
from calmotion.usd.reading.shot import StageReading, read_stage
from calmotion.usd.reading.unread import misplaced_schemas, unread_attributes

READABLE, SCHEMAS, PLACES, LIMITS = "ShotIsReadable", "SchemasAreKnown", "SchemasFit", "AnimationKeepsLimits"


def reading_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Errors and warnings of the reader, and motors that are animated beyond their limits."""
    try:
        read = read_stage(stage)
    except ShotError as error:
        yield from (finding_of(one, ERROR, READABLE) for one in each(error))
        return
    yield from (finding_of(one, WARNING, READABLE) for one in read.reading.warnings)
    yield from _beyond_limits(read)


def finding_of(error: ShotError, level: str, rule: str) -> Finding:
    """A problem as a finding."""
    found = "" if error.found is None else str(error.found)
    return Finding(level, rule, error.path, error.attribute, error.problem, found, error.remedy)


def _beyond_limits(read: StageReading) -> Iterator[Finding]:
    for motor, track in zip(read.character.motors, read.tracks, strict=True):
        joint = read.character.joints[motor.joint]
        unit = read.reading.units.meters if motor.linear else np.deg2rad(1.0)
        low, high = float(track.values.min()), float(track.values.max())
        for value, limit, beyond in ((low, joint.lower, low < joint.lower), (high, joint.upper, high > joint.upper)):
            if beyond and abs(value - limit) > 1e-6:
                yield Finding(
                    WARNING, LIMITS, motor.prim_path, motor.attribute,
                    "the animation goes beyond the limit of the joint",
                    f"{value / unit:.6g}, limit {limit / unit:.6g}", "Animate within the limit, or correct the limit",
                )  # fmt: skip


def unknown_attributes(stage: Usd.Stage) -> Iterator[Finding]:
    """Attributes in the namespace calm: that no applied schema declares."""
    return (finding_of(error, WARNING, SCHEMAS) for error in unread_attributes(stage, declared=True))


def wrong_prims(stage: Usd.Stage) -> Iterator[Finding]:
    """Calmotion's schemas on prims of the wrong kind, which USD does not check."""
    return (finding_of(error, WARNING, PLACES) for error in misplaced_schemas(stage))


Rule: TypeAlias = "Callable[[Usd.Stage], Iterable[Finding]]"

RULES: dict[str, tuple[Rule, str]] = {
    READABLE: (
        reading_findings,
        "The shot can be processed, and its motors can follow the animation within their limits.",
    ),
    SCHEMAS: (unknown_attributes, "Calmotion reads every attribute in the namespace calm:."),
    PLACES: (wrong_prims, "Calmotion's schemas are applied to prims of the right kind."),
}


_PLUGIN = "calmotion"


def validate_shot(path: str) -> Findings:
    """Everything that is wrong with a shot, at once.

    Args:
        path: File of the shot.

    Returns:
        Findings of Calmotion's rules and of every validator of the installed USD, errors first, else by place.
    """
    with quiet() as messages:
        try:
            stage = stages.open_stage(path)
            stages.refuse_result_layer(stage, path)
        except ShotError as error:
            return Findings(tuple(finding_of(one, ERROR, READABLE) for one in each(error)))
        muted = stages.earlier_layers(stage)
        if muted:
            stage = stages.open_stage(path, muted=muted)
    reported = with_places(messages, stage, prims_of(stage))
    findings = [Finding(WARNING, READABLE, place, "", message) for place, message in reported]
    with quiet():
        for name, (rule, _) in RULES.items():
            findings += _checked(name, stage, rule)
        findings += _checked("usdValidation", stage, _usd_findings)
    return Findings(tuple(sorted(dict.fromkeys(findings), key=lambda f: (f.level != ERROR, f.path, f.attribute))))


def _checked(name: str, stage: Usd.Stage, rule: Rule) -> list[Finding]:
    """The findings of a rule; an error of USD itself counts as a finding."""
    try:
        with stages.refused_by_usd(stage):
            return list(rule(stage))
    except ShotError as error:
        return [finding_of(error, ERROR, name)]


def _usd_findings(stage: Usd.Stage) -> list[Finding]:
    """The findings of USD's own validators."""
    registry = UsdValidation.ValidationRegistry()
    names = [m.name for m in registry.GetAllValidatorMetadata() if not m.name.startswith(f"{_PLUGIN}:")]
    context = UsdValidation.ValidationContext(registry.GetOrLoadValidatorsByName(names))
    kinds = {UsdValidation.ValidationErrorType.Error: ERROR, UsdValidation.ValidationErrorType.Warn: WARNING}
    findings = []
    for error in context.Validate(stage):
        level = kinds.get(error.GetType())
        if level is None:
            continue
        path, attribute = _place(error, stage)
        rule = str(error.GetIdentifier()).rpartition(".")[0]
        findings.append(Finding(level, rule, path, attribute, error.GetMessage().strip().rstrip(".")))
    return findings


def _place(error: UsdValidation.ValidationError, stage: Usd.Stage) -> tuple[str, str]:
    for site in error.GetSites():
        if site.IsProperty():
            path = site.GetProperty().GetPath()
            return str(path.GetPrimPath()), path.name
        if site.IsPrim():
            return str(site.GetPrim().GetPath()), ""
        if site.GetLayer():
            return site.GetLayer().identifier, ""
    return stage.GetRootLayer().identifier, ""


def register_validators() -> None:
    """Register Calmotion's rules in USD's validation framework, as stage validators; calling it again does nothing."""
    registry = UsdValidation.ValidationRegistry()
    for name, (rule, text) in RULES.items():
        full = f"{_PLUGIN}:{name}"
        if registry.HasValidator(full):
            continue
        metadata = UsdValidation.ValidatorMetadata(
            name=full, doc=text, keywords=[_PLUGIN], schemaTypes=[], isTimeDependent=False, isSuite=False
        )
        registry.RegisterStageValidator(metadata, _as_validator(name, rule))


def _as_validator(name: str, rule: Rule) -> Callable[[Usd.Stage, Any], list[UsdValidation.ValidationError]]:
    kinds = {ERROR: UsdValidation.ValidationErrorType.Error, WARNING: UsdValidation.ValidationErrorType.Warn}

    def validate(stage: Usd.Stage, times: Any) -> list[UsdValidation.ValidationError]:
        errors = []
        for finding in rule(stage):
            text = ShotError(
                finding.problem, attribute=finding.attribute, found=finding.found or None, remedy=finding.remedy
            ).message()
            valid = Sdf.Path.IsValidPathString(finding.path) and stage.GetPrimAtPath(finding.path)
            place = Sdf.Path(finding.path) if valid else Sdf.Path.absoluteRootPath
            site = UsdValidation.ValidationErrorSite(stage, place)
            errors.append(UsdValidation.ValidationError(name, kinds[finding.level], [site], text))
        return errors

    return validate
