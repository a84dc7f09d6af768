"""A two-link arm as a converter of URDF writes it: names of URDF in displayName, no drives, bodies below bodies."""

UPPER, FORE = "/arm/Geometry/base/upper", "/arm/Geometry/base/upper/fore"
PAN, ELBOW, MIMIC = "/arm/Physics/pan", "/arm/Physics/elbow", "/arm/Physics/finger"
CONVERTED = """#usda 1.0
(
    defaultPrim = "arm"
    kilogramsPerUnit = 1
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "arm"
{
    def Scope "Geometry"
    {
        def Xform "base"
        {
            def Xform "upper" (
                displayName = "upper-arm"
                prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]
            )
            {
                float physics:mass = 1
                point3f physics:centerOfMass = (0.2, 0, 0)
                float3 physics:diagonalInertia = (0.001, 0.01, 0.01)
                def Cube "box"
                {
                    double size = 1
                    float3 xformOp:scale = (0.4, 0.04, 0.04)
                    double3 xformOp:translate = (0.2, 0, 0)
                    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
                }
                def Xform "fore" (
                    displayName = "fore.arm"
                    prepend apiSchemas = ["PhysicsRigidBodyAPI"]
                )
                {
                    double3 xformOp:translate = (0.4, 0, 0)
                    uniform token[] xformOpOrder = ["xformOp:translate"]
                    def Cube "box"
                    {
                        double size = 0.1
                    }
                    def Xform "tool0"
                    {
                        double3 xformOp:translate = (0.3, 0, 0)
                        uniform token[] xformOpOrder = ["xformOp:translate"]
                    }
                    def Xform "finger" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
                    {
                        float physics:mass = 0.1
                        point3f physics:centerOfMass = (0, 0, 0)
                        float3 physics:diagonalInertia = (0.001, 0.001, 0.001)
                    }
                }
            }
        }
    }
    def Scope "Physics"
    {
        def PhysicsRevoluteJoint "pan" (displayName = "shoulder-pan")
        {
            uniform token physics:axis = "Y"
            rel physics:body0 = </arm>
            rel physics:body1 = </arm/Geometry/base/upper>
            float physics:lowerLimit = 10
            float physics:upperLimit = 90
        }
        def PhysicsRevoluteJoint "elbow"
        {
            uniform token physics:axis = "Y"
            rel physics:body0 = </arm/Geometry/base/upper>
            rel physics:body1 = </arm/Geometry/base/upper/fore>
            point3f physics:localPos0 = (0.4, 0, 0)
        }
        def PhysicsPrismaticJoint "finger"
        {
            uniform token physics:axis = "X"
            rel physics:body0 = </arm/Geometry/base/upper/fore>
            rel physics:body1 = </arm/Geometry/base/upper/fore/finger>
            rel newton:mimicJoint = </arm/Physics/elbow>
            float newton:mimicCoef1 = 0.01
        }
    }
}
"""
