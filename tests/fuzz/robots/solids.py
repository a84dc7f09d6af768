"""Transforms, geometry and masses of bodies in USD."""

import numpy as np
from calmotion.testing import beam_mesh
from pxr import Gf, Sdf, UsdGeom, UsdPhysics, UsdShade, Vt
from robots import Robot, Solid, placed
from scipy.spatial.transform import Rotation
from tellings import Telling


def vector(values, kind=Gf.Vec3f):
    return kind(*(float(x) for x in values))


def quaternion(R, kind=Gf.Quatf):
    w, x, y, z = Rotation.from_matrix(R).as_quat(scalar_first=True)
    return kind(float(w), float(x), float(y), float(z))


class Solids:
    """What writes bodies.

    Attributes:
        robot, t, stage, root: The robot, its telling, the stage, and the path of its root.
    """

    robot: Robot
    t: Telling
    stage: object
    root: str

    def transform(self, prim, matrix) -> None:
        """Author a transform (m) whose columns may be scaled."""
        at, scale = matrix[:3, 3] / self.t.meters, np.linalg.norm(matrix[:3, :3], axis=0)
        R, x, how = matrix[:3, :3] / scale, UsdGeom.Xformable(prim), self.t.operations
        if how == "matrix":
            whole = np.array(matrix)
            whole[:3, 3] = at
            x.AddTransformOp().Set(Gf.Matrix4d(*whole.T.ravel()))
            return
        pivot = np.array([0.3, -0.2, 0.1]) / self.t.meters if how == "pivot" else np.zeros(3)
        x.AddTranslateOp().Set(vector(at - pivot + R @ pivot, Gf.Vec3d))
        if how == "orient":
            x.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(quaternion(R, Gf.Quatd))
        elif how == "euler":
            x.AddRotateXYZOp(UsdGeom.XformOp.PrecisionDouble).Set(
                vector(Rotation.from_matrix(R).as_euler("xyz", degrees=True), Gf.Vec3d)
            )
        else:
            x.AddTranslateOp(opSuffix="pivot").Set(vector(pivot, Gf.Vec3d))
            x.AddRotateZYXOp(UsdGeom.XformOp.PrecisionDouble).Set(
                vector(Rotation.from_matrix(R).as_euler("zyx", degrees=True)[::-1], Gf.Vec3d)
            )
            x.AddTranslateOp(opSuffix="pivot", isInverseOp=True)
        if not np.allclose(scale, 1.0):
            x.AddScaleOp().Set(vector(scale))

    def scale(self, k: int):
        """Of the prim of a body along its axes."""
        solid = self.robot.solids[k]
        return solid.edges / self.t.meters if self.t.cubes and not solid.modulus else self.t.scale * np.ones(3)

    def local(self, point, k: int):
        """A point of a body's frame [m] in its prim's own axes."""
        return np.asarray(point) / (self.t.meters * self.scale(k))

    def cube(self, path: str, solid: Solid, mesh: bool = False):
        """The box of a solid, as a cube with a scale or a mesh."""
        place = placed(solid.place[:3, :3], solid.place[:3, 3] / self.t.scale) @ placed(
            np.diag(solid.edges / self.t.scale / self.t.meters)
        )
        if not mesh:
            cube = UsdGeom.Cube.Define(self.stage, path)
            cube.CreateSizeAttr(1.0)
            self.transform(cube.GetPrim(), place)
            return cube.GetPrim()
        shape = UsdGeom.Mesh.Define(self.stage, path)
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
        shape.CreatePointsAttr([vector(place[:3, :3] @ c + place[:3, 3] / self.t.meters) for c in corners])
        shape.CreateFaceVertexCountsAttr([4] * 6)
        shape.CreateFaceVertexIndicesAttr([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])
        shape.CreateSubdivisionSchemeAttr("none")
        return shape.GetPrim()

    def rigid(self, prim, solid: Solid, k: int) -> None:
        t, kg = self.t, self.t.kilograms
        density = solid.density * t.meters**3 / kg
        if t.mass == "explicit":
            mass = UsdPhysics.MassAPI.Apply(prim)
            mass.CreateMassAttr(solid.mass / kg)
            mass.CreateCenterOfMassAttr(vector(self.local(solid.place[:3, 3], k)))
            mass.CreateDiagonalInertiaAttr(vector(solid.moments / (kg * t.meters**2)))
            mass.CreatePrincipalAxesAttr(quaternion(solid.place[:3, :3]))
            return
        box = prim if t.cubes else self.cube(f"{prim.GetPath()}/Box", solid, mesh=t.geometry == "mesh")
        UsdPhysics.CollisionAPI.Apply(box)
        if t.mass == "density":
            UsdPhysics.MassAPI.Apply(prim).CreateDensityAttr(density)
        elif t.mass == "geometry":
            UsdPhysics.MassAPI.Apply(prim).CreateMassAttr(solid.mass / kg)
        else:
            stuff = UsdShade.Material.Define(self.stage, f"{self.root}/Stuff{k}")
            UsdPhysics.MaterialAPI.Apply(stuff.GetPrim()).CreateDensityAttr(density)
            UsdShade.MaterialBindingAPI.Apply(box).Bind(stuff, materialPurpose="physics")

    def flexible(self, prim, solid: Solid, k: int) -> None:
        t = self.t
        prim.AddAppliedSchema("CalmFlexibleBodyAPI")
        if t.geometry == "tets":
            prim.CreateAttribute("calm:flexible:modeCount", Sdf.ValueTypeNames.Int).Set(6)
            cells = int(np.clip(round(solid.edges[0] / solid.edges[1:].max()), 2, 8))
            points, tets = beam_mesh(solid.edges[0], 1.0, cells)
            points = self.local(points * [1.0, *solid.edges[1:]], k)
            mesh = UsdGeom.TetMesh.Define(self.stage, f"{prim.GetPath()}/Tets")
            mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
            mesh.CreateTetVertexIndicesAttr(Vt.Vec4iArray.FromNumpy(tets))
        else:
            self.cube(f"{prim.GetPath()}/Box", solid, mesh=t.geometry == "mesh")
        stuff = UsdShade.Material.Define(self.stage, f"{self.root}/Stuff{k}")
        stuff.GetPrim().AddAppliedSchema("PhysicsVolumeDeformableMaterialAPI")
        stuff.GetPrim().AddAppliedSchema("CalmDampingAPI")
        values = {
            "physics:youngsModulus": solid.modulus * t.meters / t.kilograms, "physics:poissonsRatio": 0.3,
            "physics:density": solid.density * t.meters**3 / t.kilograms, "calm:damping:ratio": solid.damping,
        }  # fmt: skip
        for name, value in values.items():
            stuff.GetPrim().CreateAttribute(name, Sdf.ValueTypeNames.Float).Set(value)
        UsdShade.MaterialBindingAPI.Apply(prim).Bind(stuff, materialPurpose="physics")
