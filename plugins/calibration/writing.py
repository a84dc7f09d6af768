"""Writing a Calibration: a layer over materials, masses and motors, and a root layer.

Each attribute has its standard deviation in `customData["calmotion"]`, in its own unit; `customLayerData["calmotion"]`
has all parameters with the hashes of the recordings, and the covariance that `optimize --robust` draws from.
"""

import os
import re
from dataclasses import fields
from typing import Any

import numpy as np
from calmotion.model import Character, Motor, Provenance
from calmotion.usd import (
    CALIBRATION,
    DAMPING_ON,
    METADATA_KEY,
    Reading,
    StageUnits,
    author_origin,
    author_stage_metadata,
    is_applied,
    open_stage,
    refuse_inputs,
    to_doubles,
    units_of,
    vector,
    write_layer,
    write_root,
)
from pxr import Gf, Sdf
from scipy.spatial.transform import Rotation

from .layer_metadata import metadata_of
from .model import kinds
from .model.estimates import WITH_THIS_MODEL_ONLY, Calibration, Estimate

GAIN_FACTOR = "calm:motor:gainFactor"
ENTRY = "calibration"  # in the metadata of the layer
_MOTOR = {
    kinds.POSITION_GAIN: "positionGain",
    kinds.VELOCITY_GAIN: "velocityGain",
    kinds.GEAR_STIFFNESS: "gearStiffness",
    kinds.ARMATURE: "armature",
    kinds.FRICTION: "friction",
    kinds.VISCOUS_FRICTION: "viscousFriction",
    kinds.DELAY: "delay",
}


def write_calibration(
    character: Character, provenance: Provenance, calibration: Calibration, output: str
) -> tuple[str, str]:
    """Write the estimated parameters over a shot.

    Args:
        character: As it was read.
        provenance: Of the shot.
        calibration: The estimates.
        output: The layer to write; the root layer goes beside it as `<stem>_root.usda`.

    Returns:
        Paths of the layer and of the root layer.

    Raises:
        ShotError: The output is a layer of the shot, or cannot be written.
    """
    refuse_inputs(provenance, output)
    stage = open_stage(provenance.shot)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_stage_metadata(layer, provenance)
    author_origin(layer, CALIBRATION, provenance)
    reading = Reading(stage, units_of(stage), provenance.start_time_code)
    _Writer(layer, reading, character, calibration).write()
    entry = {**layer.customLayerData[METADATA_KEY], ENTRY: metadata_of(character, calibration)}
    layer.customLayerData = {**layer.customLayerData, METADATA_KEY: entry}
    layer.documentation = (
        f"Parameters of the robot from {len(calibration.recordings)} recordings; {os.path.basename(output)} lies over "
        "its shot."
    )
    write_layer(layer, output)
    return output, write_root(output, provenance, CALIBRATION)


class _Writer:
    """Authors the attributes of one layer."""

    def __init__(self, layer: Sdf.Layer, reading: Reading, character: Character, calibration: Calibration):
        self._layer, self._reading, self._character = layer, reading, character
        self._values = {(item.kind, item.path, item.axis): item for item in calibration.estimates if item.of_robot}
        self._factors = calibration.gain_factors

    def write(self) -> None:
        """All of them."""
        for item in self._values.values():
            if item.kind == kinds.MODULUS:
                self._attribute(item.path, "physics:youngsModulus", item, self._units.pressure(1.0))
            elif item.kind == kinds.DENSITY:
                self._attribute(item.path, "physics:density", item, self._units.density(1.0))
            elif item.kind == kinds.DAMPING:
                self._damping(item)
            elif item.kind == kinds.MASS:
                self._mass(item)
            elif item.kind == kinds.ENCODER_OFFSET:
                self._note(item)
        for path in dict.fromkeys(item.path for item in self._values.values() if item.kind == kinds.CENTRE):
            self._center(path)
        for motor in self._character.motors:
            self._motor(motor.path, motor.linear)

    @property
    def _units(self) -> StageUnits:
        return self._reading.units

    def _damping(self, item: Estimate) -> None:
        bodies = (body.flexible.material for body in self._character.bodies if body.flexible is not None)
        material = next(own for own in bodies if own.path == item.path)
        if material.rayleigh is None:
            self._attribute(item.path, "calm:damping:ratio", item, 1.0)
        else:
            names = ("calm:damping:rayleighMass", "calm:damping:rayleighStiffness")
            for name, value in zip(names, material.rayleigh, strict=True):
                if value > 0.0:
                    self._attribute(item.path, name, item, 1.0 / value)
        self._apply(item.path, "CalmDampingAPI")

    def _mass(self, item: Estimate) -> None:
        self._attribute(item.path, "physics:mass", item, self._units.mass(1.0))
        self._apply(item.path, "PhysicsMassAPI")
        prim = self._reading.stage.GetPrimAtPath(item.path)
        authored = prim.GetAttribute("physics:diagonalInertia")
        value = authored.Get() if authored and authored.HasAuthoredValue() else None
        body = next(own for own in self._character.bodies if own.path == item.path)
        diagonal = None if value is None or not any(value) else vector(value)
        if diagonal is None and not body.surfaces and body.tets is None and body.mass is not None:
            moments, axes = np.linalg.eigh(body.mass.inertia)
            diagonal = moments / self._units.inertia(1.0)
            self._vector(item.path, "physics:principalAxes", axes * np.sign(np.linalg.det(axes)))
        if diagonal is not None:  # an inertia from geometry follows the mass by itself
            self._vector(item.path, "physics:diagonalInertia", diagonal * (item.value / item.nominal))

    def _center(self, path: str) -> None:
        prim = self._reading.stage.GetPrimAtPath(path)
        body = next(own for own in self._character.bodies if own.path == path)
        assert body.mass is not None
        scale = self._reading.pose(prim).scale * self._units.length(1.0)
        items = [self._values.get((kinds.CENTRE, path, axis)) for axis in range(3)]
        center = [body.mass.center[k] if item is None else item.value for k, item in enumerate(items)]
        spec = self._spec(path, "physics:centerOfMass", Sdf.ValueTypeNames.Point3f)
        spec.default = Gf.Vec3f(*[float(value) for value in np.array(center) / scale])
        deviations = [0.0 if item is None else item.standard_deviation for item in items]
        spec.customData = {"calmotion": {"standard_deviation": to_doubles(np.array(deviations) / np.abs(scale))}}
        self._apply(path, "PhysicsMassAPI")

    def _motor(self, path: str, linear: bool) -> None:
        units = self._units
        length = units.length(1.0) if linear else float(np.deg2rad(1.0))
        effort = units.force(1.0) if linear else units.torque(1.0)
        unit = {
            kinds.ARMATURE: units.mass(1.0) if linear else units.inertia(1.0),
            kinds.FRICTION: effort,
            kinds.DELAY: 1.0,
        }
        found = [self._values[kind, path, -1] for kind in _MOTOR if (kind, path, -1) in self._values]
        motor = next(own for own in self._character.motors if own.path == path)
        if (kinds.POSITION_GAIN, path, -1) in self._values and (motor.rotor.back_emf > 0.0 or path in self._factors):
            item = self._values[kinds.POSITION_GAIN, path, -1]
            found.remove(item)
            self._attribute(path, GAIN_FACTOR, item, motor.position_gain)
        if motor.rotor.back_emf > 0.0 and found:  # else viscous friction would hold it
            self._number(path, "calm:motor:backEmf", motor.rotor.back_emf / (effort / length))
        for item in found:
            self._attribute(path, f"calm:motor:{_MOTOR[item.kind]}", item, unit.get(item.kind, effort / length))
        self._load(motor)
        self._largest(motor, effort)
        told = {item.kind for item in found}
        gains = {kinds.POSITION_GAIN: motor.position_gain, kinds.VELOCITY_GAIN: motor.velocity_gain}
        # gains are read from one dialect: both are there, or none, and what the second multiplies
        if told & set(gains):
            self._spec(path, DAMPING_ON, Sdf.ValueTypeNames.Token).default = motor.damping_on
            for kind in set(gains) - told:
                self._number(path, f"calm:motor:{_MOTOR[kind]}", gains[kind] / (effort / length))
        if found:
            self._apply(path, "CalmMotorAPI")

    def _load(self, motor: Motor) -> None:
        """The shares of the load in the friction."""
        item = self._values.get((kinds.LOAD_FRICTION, motor.path, -1))
        if item is None:
            return
        law = motor.rotor.law.with_share(item.value)
        for part in fields(law):
            if part.name.endswith("load"):
                name = re.sub(r"_(\w)", lambda found: found[1].upper(), part.name)
                self._number(motor.path, f"calm:motor:friction:{name}", getattr(law, part.name))

    def _largest(self, motor: Motor, effort: float) -> None:
        """The largest torque, which a factor of the gain of a motor with back-EMF multiplies as well."""
        item, gain = (self._values.get((kind, motor.path, -1)) for kind in (kinds.MAX_TORQUE, kinds.POSITION_GAIN))
        if item is None:
            return
        prim = self._reading.stage.GetPrimAtPath(motor.path)
        factor = gain.value / gain.nominal if gain is not None and motor.rotor.back_emf > 0.0 else 1.0
        if prim.GetAttribute("calm:motor:voltage").HasAuthoredValue():
            duty = prim.GetAttribute("calm:motor:maxDuty").Get() or 1.0
            self._attribute(motor.path, "calm:motor:maxDuty", item, factor * motor.max_torque / duty)
            return
        self._attribute(motor.path, "calm:motor:maxTorque", item, factor * effort)
        drive = f"drive:{'linear' if motor.linear else 'angular'}:physics:maxForce"
        if prim.GetAttribute(drive).HasAuthoredValue():  # the lower of both counts
            self._attribute(motor.path, drive, item, factor * effort)

    def _note(self, item: Estimate) -> None:
        """An offset of an encoder, which no attribute of the joint has."""
        prim = Sdf.CreatePrimInLayer(self._layer, item.path)
        entry = {"encoder_offset": item.value, "standard_deviation": item.standard_deviation, "unit": item.unit}
        prim.customData = {**dict(prim.customData), "calmotion": entry}

    def _attribute(self, path: str, name: str, item: Estimate, unit: float) -> None:
        """A value in SI over its unit, with its standard deviation."""
        spec = self._number(path, name, item.value / unit)
        spec.customData = {
            "calmotion": {
                "standard_deviation": item.standard_deviation / abs(unit),
                "prior_value": item.nominal / unit,
                "prior_standard_deviation": item.prior / abs(unit),
                "identifiable": item.identifiable,
                **({"trust": WITH_THIS_MODEL_ONLY} if item.disagrees else {}),
            }
        }

    def _number(self, path: str, name: str, value: float) -> Sdf.AttributeSpec:
        spec = self._spec(path, name, Sdf.ValueTypeNames.Float)
        spec.default = float(value)
        return spec

    def _vector(self, path: str, name: str, value: np.ndarray) -> None:
        if value.ndim == 2:
            w, x, y, z = (float(part) for part in Rotation.from_matrix(value).as_quat(scalar_first=True))
            spec = self._spec(path, name, Sdf.ValueTypeNames.Quatf)
            spec.default = Gf.Quatf(w, x, y, z)
        else:
            spec = self._spec(path, name, Sdf.ValueTypeNames.Float3)
            spec.default = Gf.Vec3f(*[float(part) for part in value])

    def _spec(self, path: str, name: str, kind: Any) -> Sdf.AttributeSpec:
        """The spec of an attribute, of the type that the shot gave it."""
        attribute = self._reading.stage.GetPrimAtPath(path).GetAttribute(name)
        prim = Sdf.CreatePrimInLayer(self._layer, path)
        made = Sdf.Path(path).AppendProperty(name)
        known = attribute.GetTypeName() if attribute else kind
        return self._layer.GetAttributeAtPath(made) or Sdf.AttributeSpec(prim, name, known or kind)

    def _apply(self, path: str, schema: str) -> None:
        if is_applied(self._reading.stage.GetPrimAtPath(path), schema):
            return
        prim = Sdf.CreatePrimInLayer(self._layer, path)
        given = prim.GetInfo("apiSchemas") if prim.HasInfo("apiSchemas") else Sdf.TokenListOp()
        names = [*given.prependedItems, *([] if schema in given.prependedItems else [schema])]
        prim.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=names))
