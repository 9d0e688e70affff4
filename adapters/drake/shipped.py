"""Drake's default values."""

from __future__ import annotations

#: Stiffness of a point of contact [N/m], modulus of hydroelastic bodies [Pa], dissipation [s/m] and, in SAP,
#: relaxation time [s]. [`SceneGraphConfig.default_proximity_properties`]
POINT_STIFFNESS, MODULUS, DISSIPATION, RELAXATION = 1e6, 1e7, 50.0, 0.1
#: Slip below which friction is viscous [m/s]. [`MultibodyPlantConfig.stiction_tolerance`]
STICTION = 1e-4
#: Share of a step's own stiffness beyond which SAP treats a contact as rigid. [`sap_near_rigid_threshold`]
NEAR_RIGID = 1.0
#: Estimated error of a step of an integrator. [`SimulatorConfig.accuracy`]
ACCURACY = 1e-4
