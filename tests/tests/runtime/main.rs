//! Tests of the runtime's algorithms: assembly, integration, equilibrium, modes, stops, singular
//! states.

mod assembly;
mod equilibria;
mod lanes;
mod long_run;
mod methods;
mod modes;
mod rigid;
mod singular;
mod stiff;
mod stops;
