"""Validation of a shot by Calmotion's rules and USD's validators."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from calmotion.errors import ShotError, each
from calmotion.model.outputs import ERROR, WARNING, Finding, Findings
from calmotion.usd import stages
from calmotion.usd.diagnostics import quiet, with_places
from calmotion.usd.reading.context import prims_of
from calmotion.usd.validation.rules import READABLE, RULES, Rule, finding_of

if TYPE_CHECKING:
    from pxr import Usd, UsdValidation

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
    from pxr import UsdValidation

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
    from pxr import UsdValidation

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
    from pxr import Sdf, UsdValidation

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
