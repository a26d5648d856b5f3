//! Interface of a mechanism for callers, collected from the earlier stages.

use crate::program::{BodyInfo, ControllerInfo, FreeBodyInfo, Interface, JointInfo, ParameterInfo};
use sha2::{Digest, Sha256};

use crate::kane::Equations;
use crate::source::{Controller, JointId};

/// The interface of a mechanism.
pub fn interface(equations: &Equations, source_name: &str, source_text: &str) -> Interface {
    let (topology, mechanism) = (&equations.topology, equations.mechanism());
    let hash = Sha256::digest(source_text.as_bytes());
    let body_name = |id: crate::source::BodyId| mechanism.bodies[id.index()].name.clone();
    Interface {
        name: mechanism.name.clone(),
        source_name: source_name.to_owned(),
        source_hash: hash.iter().map(|byte| format!("{byte:02x}")).collect(),
        joints: mechanism
            .joints
            .iter()
            .enumerate()
            .map(|(index, joint)| JointInfo {
                name: joint.name.clone(),
                bodies: joint.bodies.map(body_name),
                limits: joint.limits,
                initial_q: mechanism.initial_q[index],
                initial_given: mechanism.initial_given.contains(&JointId(index)),
                initial_u: mechanism.initial_u[index],
                driven: joint.drive.is_some(),
            })
            .collect(),
        free: mechanism
            .free
            .iter()
            .map(|free| FreeBodyInfo { name: body_name(free.body), q: free.q, u: free.u })
            .collect(),
        bodies: mechanism
            .bodies
            .iter()
            .map(|body| BodyInfo { name: body.name.clone(), fixed: body.fixed })
            .collect(),
        nodes: topology.node_names(),
        points: mechanism.points.iter().map(|point| point.name.clone()).collect(),
        contacts: mechanism
            .contacts
            .iter()
            .flat_map(|contact| &contact.points)
            .map(|point| point.name.clone())
            .collect(),
        parameters: mechanism
            .parameters
            .iter()
            .map(|it| ParameterInfo { name: it.name.clone(), value: it.value, doc: it.doc.clone() })
            .collect(),
        drawn: 0,
        inputs: mechanism.inputs.clone(),
        controllers: mechanism.controllers.iter().map(controller).collect(),
        rows: equations.gamma.len(),
        loops: topology.summary_lines(),
        rank: topology.rank,
        mobility: topology.mobility,
        cuts: mechanism.cuts.iter().map(|id| mechanism.joints[id.index()].name.clone()).collect(),
        size: mechanism.size,
        reduction: equations.terms.as_ref().map(|terms| terms.pattern.clone()),
    }
}

fn controller(controller: &Controller) -> ControllerInfo {
    let memory = controller.memory.iter();
    ControllerInfo {
        name: controller.name.clone(),
        sample: controller.sample,
        delay: controller.delay,
        memory: memory.map(|memory| (memory.name.clone(), memory.initial)).collect(),
        inputs: controller.commands.iter().map(|command| command.input).collect(),
        pwm: controller.pwm,
    }
}
