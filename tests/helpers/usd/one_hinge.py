"""A rigid link of 2 kg on one hinge, with a target at its tip, as a USD shot of one second."""

TIP, HINGE = "/Robot/Link/Tip", "/Robot/Hinge"
ONE_HINGE = """#usda 1.0
(
    defaultPrim = "Robot"
    endTimeCode = 24
    kilogramsPerUnit = 1
    metersPerUnit = 1
    startTimeCode = 0
    timeCodesPerSecond = 24
    upAxis = "Z"
)
def Xform "Robot" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])
{
    def Cube "Link" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 2
        double size = 0.2
        def Xform "Tip" (prepend apiSchemas = ["CalmTargetAPI"])
        {
            double3 xformOp:translate = (0.1, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }
    def PhysicsRevoluteJoint "Hinge" (prepend apiSchemas = ["PhysicsDriveAPI:angular"])
    {
        uniform token physics:axis = "Z"
        rel physics:body1 = </Robot/Link>
        float drive:angular:physics:targetPosition.timeSamples = { 0: 0, 6: 10, 12: 30, 18: 20, 24: 0 }
    }
}
"""
