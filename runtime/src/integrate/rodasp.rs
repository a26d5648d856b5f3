//! The coefficients of RODASP (G. Steinebach, 1995), in the formulation of [`Rodas`](super::Rodas).

/// How many there are.
pub const STAGES: usize = 6;
/// The diagonal.
pub const GAMMA: f64 = 0.25;

/// Times of the stages, relative to the step.
pub const PLACE: [f64; STAGES] = [0.0, 0.75, 0.21, 0.63, 1.0, 1.0];
/// Weights of dF/dt.
pub const TIME: [f64; STAGES] = [0.25, -0.5, -0.023504, -0.0362, 0.0, 0.0];

/// The arguments of F; the fifth row, with k_5 added, is also the argument of the sixth stage.
pub const A: [[f64; 4]; 5] = [
    [0.0, 0.0, 0.0, 0.0],
    [3.0, 0.0, 0.0, 0.0],
    [1.831036793486759, 0.4955183967433795, 0.0, 0.0],
    [2.304376582692669, -0.05249275245743001, -1.176798761832782, 0.0],
    [-7.170454962423024, -4.741636671481785, -16.31002631330971, -1.062004044111401],
];

/// How the stages before change the right-hand side, by the step.
pub const C: [[f64; 5]; STAGES] = [
    [0.0; 5],
    [-12.0, 0.0, 0.0, 0.0, 0.0],
    [-8.791795173947035, -2.207865586973518, 0.0, 0.0, 0.0],
    [10.81793056857153, 6.780270611428266, 19.5348594464241, 0.0, 0.0],
    [34.19095006749676, 15.49671153725963, 54.7476087596413, 14.16005392148534, 0.0],
    [
        34.62605830930532,
        15.30084976114473,
        56.99955578662667,
        18.40807009793095,
        -5.714285714285717,
    ],
];
