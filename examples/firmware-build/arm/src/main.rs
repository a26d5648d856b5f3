//! The arm, let go with its shoulder turned to 20 degrees: where its tip is after a second, and
//! what the servo holds.

mod arm {
    include!(concat!(env!("OUT_DIR"), "/arm.rs"));
}

use arm::joint::SHOULDER;
use lamc_runtime::{Error, Rk4};

fn main() -> Result<(), Error> {
    let mut robot = arm::Arm::default();
    robot.inputs.servo = 20_f32.to_radians();
    robot.params.stiffness_elbow = 3e-3;
    let mut state = robot.assembled()?;
    let mut rk4 = Rk4::new(&robot);
    for _ in 0..1000 {
        rk4.step(&robot, &mut state, 1e-3)?;
    }
    let [tip] = robot.points(&state.q);
    let torque = robot.forces(state.t, &state.q, &state.u)?.motor[SHOULDER];
    println!("tip at {:.1} mm, the servo holds {:.3} mN m", tip[2] * 1e3, torque * 1e3);
    Ok(())
}
